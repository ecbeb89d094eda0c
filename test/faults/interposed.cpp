// Stands between depthservo and libc (LD_PRELOAD) and lets the n-th output call below a folder
// fail.
//
//   FAULTS_UNDER  the folder: a call counts where its path, or that of its file, is below it
//   FAULTS_KIND   full, read-only, file-limit: that call and all after it; io, interrupted, short,
//                 kill: that call alone
//                 often-interrupted, often-short: every second write or read of a file, or of a pipe
//                 there, by the program itself
//   FAULTS_AT     number of the call, from 1, among those that can fail like that; 0: none
//   FAULTS_TOLD   file that gets "<naming> <writing> <finishing> <removing calls> <name of the call
//                 that failed>"
//   FAULTS_CLOCK  seconds by which the wall clock jumps every time it is read, to and fro
//   FAULTS_LOCALE set: the process begins with the user's locale, as programs with windows do
//
// Calls within libc (of stdio on its own) cannot be seen: what goes by FILE is met at fwrite and
// fclose. Programs that depthservo starts are left alone.

#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <locale.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

enum class Call { naming, writing, finishing, removing };
constexpr int kKindsOfCalls = 4;

struct Plan {
  Plan() {
    const auto text = [](const char* name) {
      const char* value = getenv(name);
      return value ? value : "";
    };
    snprintf(under, sizeof under, "%s", text("FAULTS_UNDER"));
    snprintf(kind, sizeof kind, "%s", text("FAULTS_KIND"));
    snprintf(told, sizeof told, "%s", text("FAULTS_TOLD"));
    at = strtoll(text("FAULTS_AT"), nullptr, 10);
    clockStep_s = strtol(text("FAULTS_CLOCK"), nullptr, 10);
    if (*text("FAULTS_LOCALE") != '\0' && !setlocale(LC_ALL, "")) abort();
    unsetenv("LD_PRELOAD");
  }
  ~Plan() {
    if (failed[0] == '\0') tell();
  }

  void tell() const {
    if (told[0] == '\0') return;
    char line[256];
    const int length = snprintf(line, sizeof line, "%d %d %d %d %s\n", count[0].load(),
                                count[1].load(), count[2].load(), count[3].load(), failed);
    const long file = syscall(SYS_openat, AT_FDCWD, told, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (syscall(SYS_write, file, line, length) != length) abort();
    syscall(SYS_close, file);
  }

  bool isOften() const { return strncmp(kind, "often-", 6) == 0; }
  bool is(const char* name) const { return strcmp(kind, name) == 0; }
  bool canFail(Call call) const {
    if (is("kill")) return true;
    if (is("interrupted") || is("short") || is("file-limit")) return call == Call::writing;
    if (is("read-only")) return call == Call::naming;
    return call != Call::removing;
  }
  int error() const {
    if (is("full")) return ENOSPC;
    if (is("read-only")) return EROFS;
    if (is("file-limit")) return EFBIG;
    return is("interrupted") ? EINTR : EIO;
  }
  bool isLasting() const { return is("full") || is("read-only") || is("file-limit"); }

  char under[PATH_MAX], kind[32], told[PATH_MAX], failed[64] = "";
  long long at = 0;
  long clockStep_s = 0;
  std::atomic<long long> calls{0};
  std::atomic<int> count[kKindsOfCalls]{};
};

Plan& plan() {
  static Plan plan;
  return plan;
}
[[maybe_unused]] const Plan& kBegun = plan();  // before main

bool isBelow(const char* path) {
  const std::size_t length = strlen(plan().under);
  char absolute[2 * PATH_MAX];
  if (length == 0) return false;
  if (path[0] != '/') {
    char here[PATH_MAX];
    if (syscall(SYS_getcwd, here, sizeof here) <= 0) return false;
    snprintf(absolute, sizeof absolute, "%s/%s", here, path);
    path = absolute;
  }
  return strncmp(path, plan().under, length) == 0 && path[length] == '/';
}

/// Pipes, too.
bool isThere(int file) {
  char link[64], path[PATH_MAX];
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  if (length <= 0) return false;
  path[length] = '\0';
  return isBelow(path);
}

bool isBelow(int file) {
  struct stat status;
  return isThere(file) && fstat(file, &status) == 0 && !S_ISFIFO(status.st_mode);
}

enum class Disturbance { none, interrupted, isShort };

/// Of a write or read, where they are disturbed often.
Disturbance disturbanceOf(int file) {
  if (!plan().isOften() || !isThere(file) || ++plan().calls % 2 == 0) return Disturbance::none;
  return plan().is("often-short") ? Disturbance::isShort : Disturbance::interrupted;
}

bool isBelow(FILE* stream) { return isBelow(fileno(stream)); }

bool isBelow(int folder, const char* path) {
  return path[0] == '/' || folder == AT_FDCWD ? isBelow(path) : isBelow(folder);
}

/// Whether this call of the tool is to fail.
bool fails(const char* name, Call call, bool isMeant) {
  Plan& p = plan();
  if (!isMeant || p.isOften()) return false;
  ++p.count[static_cast<int>(call)];
  if (!p.canFail(call)) return false;
  const long long number = ++p.calls;
  if (p.at == 0 || number < p.at || (number > p.at && !p.isLasting())) return false;
  if (number == p.at) {
    snprintf(p.failed, sizeof p.failed, "%s", name);
    p.tell();
  }
  if (p.is("kill")) syscall(SYS_kill, getpid(), SIGKILL);
  errno = p.error();
  return true;
}

bool isShort() { return plan().is("short"); }

bool isForWriting(int flags) { return (flags & O_ACCMODE) != O_RDONLY; }
bool isForWriting(const char* mode) { return strpbrk(mode, "wa+") != nullptr; }
bool isOutput(int file) {
  const int flags = fcntl(file, F_GETFL);
  return flags >= 0 && isForWriting(flags) && isBelow(file);
}

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

#define NEXT(function) static auto* const real = next<decltype(function)>(#function)

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

#define OPEN(function)                                                                   \
  int function(const char* path, int flags, ...) {                                       \
    va_list more;                                                                        \
    va_start(more, flags);                                                               \
    const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0; \
    va_end(more);                                                                        \
    static auto* const real = next<int(const char*, int, ...)>(#function);               \
    if (fails(#function, Call::naming, isForWriting(flags) && isBelow(path))) return -1; \
    return real(path, flags, mode);                                                      \
  }
OPEN(open)
OPEN(open64)

#define OPENAT(function)                                                                         \
  int function(int folder, const char* path, int flags, ...) {                                   \
    va_list more;                                                                                \
    va_start(more, flags);                                                                       \
    const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;         \
    va_end(more);                                                                                \
    static auto* const real = next<int(int, const char*, int, ...)>(#function);                  \
    if (fails(#function, Call::naming, isForWriting(flags) && isBelow(folder, path))) return -1; \
    return real(folder, path, flags, mode);                                                      \
  }
OPENAT(openat)
OPENAT(openat64)

#define FOPEN(function)                                                                      \
  FILE* function(const char* path, const char* mode) {                                       \
    NEXT(function);                                                                          \
    if (fails(#function, Call::naming, isForWriting(mode) && isBelow(path))) return nullptr; \
    return real(path, mode);                                                                 \
  }
FOPEN(fopen)
FOPEN(fopen64)

#define DISTURB(file, count)                                 \
  switch (disturbanceOf(file)) {                             \
    case Disturbance::interrupted:                           \
      errno = EINTR;                                         \
      return -1;                                             \
    case Disturbance::isShort:                               \
      count = (count + 1) / 2;                               \
      break;                                                 \
    case Disturbance::none:                                  \
      break;                                                 \
  }

ssize_t read(int file, void* bytes, size_t count) {
  NEXT(read);
  DISTURB(file, count)
  return real(file, bytes, count);
}

#define PREAD(function)                                                     \
  ssize_t function(int file, void* bytes, size_t count, off_t at) {         \
    NEXT(function);                                                         \
    DISTURB(file, count)                                                    \
    return real(file, bytes, count, at);                                    \
  }
PREAD(pread)
PREAD(pread64)

ssize_t write(int file, const void* bytes, size_t count) {
  NEXT(write);
  DISTURB(file, count)
  if (!fails("write", Call::writing, isBelow(file))) return real(file, bytes, count);
  return isShort() ? real(file, bytes, (count + 1) / 2) : -1;
}

ssize_t writev(int file, const iovec* parts, int count) {
  NEXT(writev);
  const Disturbance disturbance = disturbanceOf(file);
  if (disturbance == Disturbance::interrupted) {
    errno = EINTR;
    return -1;
  }
  if (disturbance == Disturbance::isShort && parts[0].iov_len > 1) return real(file, parts, 1);
  if (!fails("writev", Call::writing, isBelow(file))) return real(file, parts, count);
  if (!isShort()) return -1;
  const iovec part{parts[0].iov_base, (parts[0].iov_len + 1) / 2};
  return part.iov_len > 0 ? real(file, &part, 1) : real(file, parts, count);
}

#define PWRITE(function)                                                                      \
  ssize_t function(int file, const void* bytes, size_t count, off_t at) {                     \
    NEXT(function);                                                                           \
    if (!fails(#function, Call::writing, isBelow(file))) return real(file, bytes, count, at); \
    return isShort() ? real(file, bytes, (count + 1) / 2, at) : -1;                           \
  }
PWRITE(pwrite)
PWRITE(pwrite64)

/// stdio has dealt with interruptions and short writes within it.
size_t fwrite(const void* bytes, size_t size, size_t count, FILE* stream) {
  NEXT(fwrite);
  const bool canFail = !plan().is("interrupted") && !plan().is("short");
  if (fails("fwrite", Call::writing, canFail && isBelow(stream))) return 0;
  return real(bytes, size, count, stream);
}

/// The file is closed all the same, as the system does.
int fclose(FILE* stream) {
  NEXT(fclose);
  const bool isFault = fails("fclose", Call::finishing, isOutput(fileno(stream)));
  const int error = errno, result = real(stream);
  if (!isFault) return result;
  errno = error;
  return EOF;
}

int close(int file) {
  NEXT(close);
  const bool isFault = fails("close", Call::finishing, isOutput(file));
  const int error = errno, result = real(file);
  if (!isFault) return result;
  errno = error;
  return -1;
}

#define ON_FILE(function)                                                      \
  int function(int file) {                                                     \
    NEXT(function);                                                            \
    return fails(#function, Call::finishing, isBelow(file)) ? -1 : real(file); \
  }
ON_FILE(fsync)
ON_FILE(fdatasync)

#define TRUNCATE(function)                                                           \
  int function(int file, off_t size) {                                               \
    NEXT(function);                                                                  \
    return fails(#function, Call::finishing, isBelow(file)) ? -1 : real(file, size); \
  }
TRUNCATE(ftruncate)
TRUNCATE(ftruncate64)

int mkdir(const char* path, mode_t mode) {
  NEXT(mkdir);
  return fails("mkdir", Call::naming, isBelow(path)) ? -1 : real(path, mode);
}

char* mkdtemp(char* path) {
  NEXT(mkdtemp);
  return fails("mkdtemp", Call::naming, isBelow(path)) ? nullptr : real(path);
}

int rename(const char* from, const char* to) {
  NEXT(rename);
  return fails("rename", Call::naming, isBelow(to)) ? -1 : real(from, to);
}

int renameat2(int fromFolder, const char* from, int toFolder, const char* to, unsigned flags) {
  NEXT(renameat2);
  if (fails("renameat2", Call::naming, isBelow(toFolder, to))) return -1;
  return real(fromFolder, from, toFolder, to, flags);
}

int link(const char* from, const char* to) {
  NEXT(link);
  return fails("link", Call::naming, isBelow(to)) ? -1 : real(from, to);
}

int chmod(const char* path, mode_t mode) {
  NEXT(chmod);
  return fails("chmod", Call::naming, isBelow(path)) ? -1 : real(path, mode);
}

int fchmodat(int folder, const char* path, mode_t mode, int flags) {
  NEXT(fchmodat);
  if (fails("fchmodat", Call::naming, isBelow(folder, path))) return -1;
  return real(folder, path, mode, flags);
}

#define REMOVE(function)                                                      \
  int function(const char* path) {                                            \
    NEXT(function);                                                           \
    return fails(#function, Call::removing, isBelow(path)) ? -1 : real(path); \
  }
REMOVE(remove)
REMOVE(unlink)
REMOVE(rmdir)

int unlinkat(int folder, const char* path, int flags) {
  NEXT(unlinkat);
  const bool isMeant = isBelow(folder, path);
  return fails("unlinkat", Call::removing, isMeant) ? -1 : real(folder, path, flags);
}

int clock_gettime(clockid_t clock, timespec* time) {
  NEXT(clock_gettime);
  static std::atomic<unsigned> reads{0};
  const int result = real(clock, time);
  if (result == 0 && clock == CLOCK_REALTIME && plan().clockStep_s != 0) {
    time->tv_sec += reads++ % 2 == 0 ? plan().clockStep_s : -plan().clockStep_s;
  }
  return result;
}

}  // extern "C"
#pragma GCC visibility pop
