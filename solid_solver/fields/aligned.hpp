#pragma once

#include <cstddef>
#include <new>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace ocublast::solid {

/// Allocator of 64-byte aligned memory: one cache line, one AVX-512 register. Arrays of many pages
/// start at a huge page and ask the system for such: the element loop streams through them, and
/// small pages cost a miss of the translation cache each.
template <class T>
struct AlignedAllocator {
  using value_type = T;
  static constexpr std::size_t line = 64;
  static constexpr std::size_t huge_page = std::size_t{1} << 21;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) noexcept {}
  T* allocate(std::size_t n) {
    const std::size_t bytes = n * sizeof(T);
    void* p = ::operator new(bytes, alignment(bytes));
#if defined(__linux__)
    // Whole huge pages only; advice that is not taken costs nothing.
    if (bytes >= huge_page)
      static_cast<void>(madvise(p, bytes / huge_page * huge_page, MADV_HUGEPAGE));
#endif
    return static_cast<T*>(p);
  }
  void deallocate(T* p, std::size_t n) noexcept {
    ::operator delete(p, alignment(n * sizeof(T)));
  }
  bool operator==(const AlignedAllocator&) const = default;

 private:
  static std::align_val_t alignment(std::size_t bytes) {
    return std::align_val_t{bytes >= huge_page ? huge_page : line};
  }
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace ocublast::solid
