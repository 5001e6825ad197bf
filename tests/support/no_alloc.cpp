// malloc and its relatives of the test binary, counting and forwarding to glibc. free stays glibc's own.
// Sanitizers bring their own malloc; there their hook counts instead.
#include "tests/support/no_alloc.h"

#include <cerrno>
#include <cstddef>

namespace knuckle::test {
namespace {
// Part of the executable's static TLS block, so touching it inside malloc never allocates.
thread_local std::uint64_t count = 0;
}  // namespace

std::uint64_t thread_allocations() noexcept {
  return count;
}

}  // namespace knuckle::test

extern "C" {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

void __sanitizer_malloc_hook(const volatile void*, std::size_t) {
  ++knuckle::test::count;
}

#else

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) noexcept {
  ++knuckle::test::count;
  return __libc_malloc(size);
}
void* calloc(std::size_t items, std::size_t size) noexcept {
  ++knuckle::test::count;
  return __libc_calloc(items, size);
}
void* realloc(void* block, std::size_t size) noexcept {
  ++knuckle::test::count;
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  ++knuckle::test::count;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  return memalign(alignment, size);
}
int posix_memalign(void** result, std::size_t alignment, std::size_t size) noexcept {
  void* const block = memalign(alignment, size);
  if (block == nullptr) return ENOMEM;
  *result = block;
  return 0;
}

#endif
}
