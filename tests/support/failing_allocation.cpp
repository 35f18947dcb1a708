// SPDX-License-Identifier: GPL-3.0-or-later
// Preloaded into a program, fails one allocation: the FAILING_ALLOCATION-th from the beginning of
// main() on, or none. Writes to the file COUNT_ALLOCATIONS how many there were, if it is given.
// What fails before main() begins, while libraries are loaded, no program can tell its user.
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>

#include <dlfcn.h>

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming): names of the C library
extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
}

namespace {

using Main = int (*)(int, char**, char**);

std::atomic<bool> is_counting = false;
std::atomic<long> count = 0;
long failing = 0;
Main main_of_program = nullptr;

bool fails() {
  if (!is_counting || ++count != failing) return false;
  errno = ENOMEM;
  return true;
}

void write_count() {
  is_counting = false;
  const char* const path = std::getenv("COUNT_ALLOCATIONS");
  if (path == nullptr) return;
  std::FILE* const file = std::fopen(path, "w");
  if (file == nullptr) return;
  std::fprintf(file, "%ld\n", count.load());
  std::fclose(file);
}

int counted_main(int argc, char** argv, char** environment) {
  const char* const nth = std::getenv("FAILING_ALLOCATION");
  failing = nth == nullptr ? 0 : std::atol(nth);
  std::atexit(write_count);
  is_counting = true;
  return main_of_program(argc, argv, environment);
}

}  // namespace

extern "C" {
void* malloc(size_t size) { return fails() ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) { return fails() ? nullptr : __libc_calloc(count, size); }
void* realloc(void* old, size_t size) { return fails() ? nullptr : __libc_realloc(old, size); }
void* memalign(size_t alignment, size_t size) {
  return fails() ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }
int posix_memalign(void** out, size_t alignment, size_t size) {
  void* const memory = memalign(alignment, size);
  if (memory == nullptr) return ENOMEM;
  *out = memory;
  return 0;
}

int __libc_start_main(Main main,
                      int argc,
                      char** argv,
                      void (*init)(),
                      void (*fini)(),
                      void (*loader_fini)(),
                      void* stack_end) {
  main_of_program = main;
  const auto start =
      reinterpret_cast<decltype(&__libc_start_main)>(dlsym(RTLD_NEXT, "__libc_start_main"));
  return start(counted_main, argc, argv, init, fini, loader_fini, stack_end);
}
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)
