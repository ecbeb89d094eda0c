#include "depthservo/text/NewFolder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>

#include "depthservo/text/InputError.h"
#include "depthservo/text/InterruptWatch.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

/// A folder that disappears unless it is kept by renaming it.
class TemporarySibling {
 public:
  explicit TemporarySibling(const fs::path& final)
      : final_(final),
        path_(final.parent_path() / fmt::format(".{}.{}", final.filename().string(), getpid())) {
    if (!fs::create_directory(path_)) throw InputError({path_.string(), 0, ""}, "is in the way");
  }
  ~TemporarySibling() {
    std::error_code ignored;
    if (!kept_) fs::remove_all(path_, ignored);
  }
  TemporarySibling(const TemporarySibling&) = delete;
  TemporarySibling& operator=(const TemporarySibling&) = delete;

  const fs::path& path() const { return path_; }
  void keep() {
    watch_.stopIfInterrupted();
    fs::rename(path_, final_);
    kept_ = true;
  }

 private:
  InterruptWatch watch_;
  fs::path final_, path_;
  bool kept_ = false;
};

/// Absolute, without a trailing slash: it has a parent and a name.
fs::path normalised(const fs::path& folder) {
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  return absolute.has_filename() ? absolute : absolute.parent_path();
}

}  // namespace

void requireNewRunFolder(const fs::path& folder) {
  const fs::path place = normalised(folder);
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(place, ignored))) {
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

void makeFolder(const fs::path& folder, const std::function<void(const fs::path&)>& fill) {
  requireNewRunFolder(folder);
  try {
    TemporarySibling temporary(normalised(folder));
    fill(temporary.path());
    temporary.keep();
  } catch (const fs::filesystem_error& error) {
    throw InputError({folder.string(), 0, ""},
                     fmt::format("cannot be written: {}", error.code().message()));
  }
}

void requireNewFile(const std::string& file) {
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(file, ignored))) {
    throw InputError({file, 0, ""}, "exists already; choose another name");
  }
  const fs::path folder = fs::absolute(file).parent_path();
  if (!fs::is_directory(folder, ignored) || access(folder.c_str(), W_OK | X_OK) != 0) {
    throw InputError({file, 0, ""}, "cannot be written: its folder is missing or not writable");
  }
}

namespace {

std::string temporaryName(const std::string& file) {
  return fmt::format("{}.{}.part", file, getpid());
}

/// Gives a file its name, which nothing must have. \throw InputError
void appear(const std::string& temporary, const std::string& file) {
  std::error_code error, ignored;
  fs::create_hard_link(temporary, file, error);
  const bool hasNoLinks = error && error != std::errc::file_exists;  // on this file system
  if (hasNoLinks) fs::rename(temporary, file, error);
  fs::remove(temporary, ignored);
  if (error) throw InputError({file, 0, ""}, "cannot be written, or exists already");
}

}  // namespace

NewFile::NewFile(std::string file) : file_(std::move(file)), temporary_(temporaryName(file_)) {
  requireNewFile(file_);
  stream_.open(temporary_, std::ios::binary);
}

NewFile::~NewFile() {
  std::error_code ignored;
  stream_.close();
  fs::remove(temporary_, ignored);
}

void NewFile::write(std::string_view bytes) {
  watch_.stopIfInterrupted();
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  size_ += bytes.size();
}

void NewFile::keep() {
  stream_.close();
  if (!stream_) throw InputError({file_, 0, ""}, "cannot be written");
  watch_.stopIfInterrupted();
  appear(temporary_, file_);
}

void makeFile(const std::string& file, const std::function<bool(const std::string&)>& fill) {
  requireNewFile(file);
  const std::string temporary = temporaryName(file);
  if (fill(temporary)) return appear(temporary, file);
  std::error_code ignored;
  fs::remove(temporary, ignored);
  throw InputError({file, 0, ""}, "cannot be written, or exists already");
}

void makeFile(const std::string& file, const std::string& text) {
  makeFile(file, [&](const std::string& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    stream << text;
    stream.close();
    return static_cast<bool>(stream);
  });
}

}  // namespace depthservo
