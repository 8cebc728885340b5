/* Preloaded, counts the allocations of a program and tells them at its end. */
#include <stddef.h>
#include <stdio.h>
void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
static long count;
void *malloc(size_t size) { count++; return __libc_malloc(size); }
void *calloc(size_t n, size_t size) { count++; return __libc_calloc(n, size); }
void *realloc(void *old, size_t size) { count++; return __libc_realloc(old, size); }
__attribute__((destructor)) static void report(void) { fprintf(stderr, "%ld allocations\n", count); }
