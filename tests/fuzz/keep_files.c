// Preloaded into tests by make_corpus.sh: what they have written is copied into the folder $KEEP_FILES before it is
// removed. Files of at most 64 KiB, each content once.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static void keep(int folder, const char* name) {
  char bytes[(1 << 16) + 1], path[4096];
  const char* to = getenv("KEEP_FILES");
  struct stat facts;
  if (!to || fstatat(folder, name, &facts, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISREG(facts.st_mode)) return;
  const int from = openat(folder, name, O_RDONLY | O_CLOEXEC);
  const ssize_t size = from < 0 ? -1 : read(from, bytes, sizeof bytes);
  if (from >= 0) close(from);
  if (size <= 0 || size == (ssize_t)sizeof bytes) return;
  uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (ssize_t i = 0; i < size; ++i) hash = (hash ^ (unsigned char)bytes[i]) * 1099511628211u;
  snprintf(path, sizeof path, "%s/%016llx", to, (unsigned long long)hash);
  const int kept = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (kept < 0) return;  // there already
  if (write(kept, bytes, (size_t)size) != size) abort();
  close(kept);
}

int unlinkat(int folder, const char* name, int flags) {
  if (!(flags & AT_REMOVEDIR)) keep(folder, name);
  return ((int (*)(int, const char*, int))dlsym(RTLD_NEXT, "unlinkat"))(folder, name, flags);
}

int unlink(const char* path) {
  keep(AT_FDCWD, path);
  return ((int (*)(const char*))dlsym(RTLD_NEXT, "unlink"))(path);
}

int remove(const char* path) {
  keep(AT_FDCWD, path);
  return ((int (*)(const char*))dlsym(RTLD_NEXT, "remove"))(path);
}
