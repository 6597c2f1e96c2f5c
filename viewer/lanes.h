/*
 * lanes.h - code that is compiled for several processors, of which the best that is there runs.
 *
 * A body is SPV_INLINE; SPV_VERSIONS makes a function of it for each set of instructions, so that a test
 * can compare them. All do the same correctly rounded operations, none fused (-ffp-contract=off): they
 * give the same bytes. Vectors are of 256 bits in both wide ones; AVX-512 has masks and twice the registers.
 */
#ifndef SPV_LANES_H
#define SPV_LANES_H

#include <stdbool.h>

enum spv_lanes { SPV_LANES_PLAIN, SPV_LANES_AVX2, SPV_LANES_AVX512, SPV_LANES_COUNT };
static const char *const SPV_LANES_NAME[SPV_LANES_COUNT] = {"no vectors", "AVX2", "AVX-512"};

#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
#define SPV_AVX2 __attribute__((target("avx2")))
#define SPV_AVX512 __attribute__((target("avx2,bmi2,avx512f,avx512bw,avx512cd,avx512dq,avx512vl")))
static inline enum spv_lanes spv_lanes_here(void)
{
    const bool avx512 = __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("avx512f") &&
                        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
                        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    return !__builtin_cpu_supports("avx2") ? SPV_LANES_PLAIN : avx512 ? SPV_LANES_AVX512 : SPV_LANES_AVX2;
}
#else
#define SPV_AVX2
#define SPV_AVX512
static inline enum spv_lanes spv_lanes_here(void)
{
    return SPV_LANES_PLAIN;
}
#endif

#define SPV_INLINE static inline __attribute__((always_inline))

/* name[lanes] does what body does. params: in parentheses, as declared; args: their names. */
#define SPV_VERSIONS(name, body, params, args)                                                     \
    static void name##_plain params { body args; }                                                 \
    SPV_AVX2 static void name##_avx2 params { body args; }                                         \
    SPV_AVX512 static void name##_avx512 params { body args; }                                     \
    static void(*const name[SPV_LANES_COUNT]) params = {name##_plain, name##_avx2, name##_avx512}

/* Before a short loop that must not be unrolled before it can become vectors. */
#if defined(__GNUC__) && !defined(__clang__)
#define SPV_ROLLED _Pragma("GCC unroll 1")
#else
#define SPV_ROLLED
#endif

#endif
