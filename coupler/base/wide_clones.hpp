#pragma once

/// Before a function with loops over many numbers: compiled for wider registers too, chosen when
/// the program is loaded. Not under the thread sanitiser, whose code in what chooses would run
/// before it is set up.
#if defined(__SANITIZE_THREAD__)
#define OCU_WIDE_CLONES
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define OCU_WIDE_CLONES
#endif
#endif
#ifndef OCU_WIDE_CLONES
#define OCU_WIDE_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
