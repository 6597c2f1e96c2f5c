/*
 * lanes.h - code that is compiled twice, for processors with 256-bit vectors and for all.
 *
 * A body is SPV_INLINE; two functions hold it, one of them SPV_WIDE, and a flag chooses between
 * them, so that a test can compare the two. Both do the same correctly rounded operations, none
 * fused (-ffp-contract=off): they give the same bytes.
 */
#ifndef SPV_LANES_H
#define SPV_LANES_H

#include <stdbool.h>

#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
#define SPV_WIDE __attribute__((target("avx2")))
static inline bool spv_wide_here(void)
{
    return __builtin_cpu_supports("avx2");
}
#else
#define SPV_WIDE
static inline bool spv_wide_here(void)
{
    return false;
}
#endif

#define SPV_INLINE static inline __attribute__((always_inline))

/* Before a short loop that must not be unrolled before it can become vectors. */
#if defined(__GNUC__) && !defined(__clang__)
#define SPV_ROLLED _Pragma("GCC unroll 1")
#else
#define SPV_ROLLED
#endif

#endif
