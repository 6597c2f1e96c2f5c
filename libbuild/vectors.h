/*
 * vectors.h - loops that become vectors.
 *
 * SPB_VECTORS before a function compiles it a second time for processors with 256-bit vectors; the
 * C library chooses. Both do the same correctly rounded operations, none fused (-ffp-contract=off),
 * so both give the same bytes. Functions that they call are SPB_INLINE or SPB_VECTORS themselves.
 */
#ifndef SPB_VECTORS_H
#define SPB_VECTORS_H

#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__clang__) &&                     \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !defined(SPB_NO_VECTORS)
#define SPB_VECTORS __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define SPB_VECTORS
#endif

/* Before a short loop that must not be unrolled before it can become vectors. */
#if defined(__GNUC__) && !defined(__clang__)
#define SPB_ROLLED _Pragma("GCC unroll 1")
#else
#define SPB_ROLLED
#endif

#define SPB_INLINE static inline __attribute__((always_inline))

#endif
