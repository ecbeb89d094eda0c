#include "depthservo/text/NewFolder.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "depthservo/text/InputError.h"
#include "depthservo/text/InterruptWatch.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

/// Absolute, without a trailing slash: it has a parent and a name.
fs::path normalised(const fs::path& folder) {
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  return absolute.has_filename() ? absolute : absolute.parent_path();
}

bool isThere(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(path, ignored));
}

/// Makes a folder beside the place, hidden, that anybody else has not. Its rights are what any
/// other's are (those of mkdtemp are not). \throw InputError named as the place
fs::path hiddenFolder(const fs::path& place, const fs::path& named) {
  static std::atomic<unsigned> number{0};
  for (;;) {
    const fs::path path = place.parent_path() / fmt::format(".{}.{}-{}", place.filename().string(),
                                                            getpid(), number++);
    if (mkdir(path.c_str(), 0777) == 0) return path;
    if (errno != EEXIST) throw notWritten(named);
  }
}

}  // namespace

InputError notWritten(const fs::path& file) {
  return InputError({file.string(), 0, ""},
                    fmt::format("cannot be written: {}", std::strerror(errno)));
}

void requireNewRunFolder(const fs::path& folder) {
  const fs::path place = normalised(folder);
  std::error_code ignored;
  if (isThere(place)) {
    throw InputError({folder.string(), 0, ""}, "exists already; name a new folder");
  }
  const fs::path parent = place.parent_path();
  if (!fs::is_directory(parent, ignored)) {
    throw InputError({folder.string(), 0, ""},
                     fmt::format("cannot be made: {} is not a folder", parent.string()));
  }
  if (access(parent.c_str(), W_OK | X_OK) != 0) {
    throw InputError({folder.string(), 0, ""},
                     fmt::format("cannot be made: {} is not writable", parent.string()));
  }
}

NewFolder::NewFolder(const fs::path& folder) : folder_(folder), final_(normalised(folder)) {
  requireNewRunFolder(folder);
  path_ = hiddenFolder(final_, folder_);
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  if (!isKept_) fs::remove_all(path_, ignored);
}

InputError NewFolder::named(const InputError& error) const {
  const std::string place = path_.string() + '/', &file = error.file();
  if (file.compare(0, place.size(), place) != 0) return error;
  return InputError({(folder_ / file.substr(place.size())).string(), error.line(), error.key()},
                    error.message());
}

void NewFolder::keep() {
  watch_.stopIfInterrupted();
  if (isThere(final_)) {
    throw InputError({folder_.string(), 0, ""}, "exists already, made by another; name a new one");
  }
  if (std::rename(path_.c_str(), final_.c_str()) != 0) throw notWritten(folder_);
  isKept_ = true;
}

void makeFolder(const fs::path& folder, const std::function<void(const fs::path&)>& fill) {
  NewFolder made(folder);
  try {
    fill(made.path());
  } catch (const fs::filesystem_error& error) {
    throw InputError({folder.string(), 0, ""},
                     fmt::format("cannot be written: {}", error.code().message()));
  } catch (const InputError& error) {
    throw made.named(error);
  }
  made.keep();
}

void requireNewFile(const std::string& file) {
  if (isThere(file)) throw InputError({file, 0, ""}, "exists already; choose another name");
  std::error_code ignored;
  const fs::path folder = fs::absolute(file).parent_path();
  if (!fs::is_directory(folder, ignored) || access(folder.c_str(), W_OK | X_OK) != 0) {
    throw InputError({file, 0, ""}, "cannot be written: its folder is missing or not writable");
  }
}

namespace {

std::string temporaryName(const std::string& file) {
  return fmt::format("{}.{}.part", file, getpid());
}

void removeQuietly(const std::string& file) {
  std::error_code ignored;
  fs::remove(file, ignored);
}

/// Gives a file its name, which nothing must have. \throw InputError
void appear(const std::string& temporary, const std::string& file) {
  int failed = link(temporary.c_str(), file.c_str());
  const bool hasNoLinks = failed != 0 && errno != EEXIST;  // on this file system
  if (hasNoLinks && !isThere(file)) failed = std::rename(temporary.c_str(), file.c_str());
  const int error = errno;
  removeQuietly(temporary);
  errno = error;
  if (failed != 0) throw notWritten(file);
}

/// \throw InputError of the file that it is to become
void writeText(const std::string& temporary, std::string_view text, const std::string& file) {
  std::ofstream stream(temporary, std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream) stream.close();
  if (stream) return;
  const InputError error = notWritten(file);
  stream.close();
  removeQuietly(temporary);
  throw error;
}

}  // namespace

NewFile::NewFile(std::string file) : file_(std::move(file)), temporary_(temporaryName(file_)) {
  requireNewFile(file_);
  stream_.open(temporary_, std::ios::binary);
  if (!stream_) throw notWritten(file_);
}

NewFile::~NewFile() {
  stream_.close();
  removeQuietly(temporary_);
}

void NewFile::write(std::string_view bytes) {
  watch_.stopIfInterrupted();
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!stream_) throw notWritten(file_);
  size_ += bytes.size();
}

void NewFile::keep() {
  stream_.close();
  if (!stream_) throw notWritten(file_);
  watch_.stopIfInterrupted();
  appear(temporary_, file_);
}

void makeFile(const std::string& file, const std::string& text) {
  requireNewFile(file);
  const std::string temporary = temporaryName(file);
  writeText(temporary, text, file);
  appear(temporary, file);
}

void replaceFile(const fs::path& file, std::string_view text) {
  std::error_code error;
  const fs::path linked = fs::is_symlink(file, error) ? fs::canonical(file, error) : file;
  const std::string final = error ? file.string() : linked.string(), part = final + ".part";
  writeText(part, text, file.string());
  if (std::rename(part.c_str(), final.c_str()) == 0) return;
  const InputError failure = notWritten(file);
  removeQuietly(part);
  throw failure;
}

}  // namespace depthservo
