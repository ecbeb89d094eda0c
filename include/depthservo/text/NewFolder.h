#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>

#include "depthservo/api.h"
#include "depthservo/text/InputError.h"
#include "depthservo/text/InterruptWatch.h"

namespace depthservo {

/// What the last call of the system says of a file that could not be written (errno).
DEPTHSERVO_API InputError notWritten(const std::filesystem::path& file);

/// Refuses a place where no folder can be made: it exists already, or its parent is missing or
/// not writable. Call it before a long run. \throw InputError
DEPTHSERVO_API void requireNewRunFolder(const std::filesystem::path& folder);

/// A folder that is filled bit by bit, whole or not at all: until it is kept it has another, hidden
/// name beside its place, and without that it is gone again. (Whoever is killed leaves it under
/// that name, which is in nobody's way.)
class DEPTHSERVO_API NewFolder {
 public:
  /// \throw InputError see requireNewRunFolder, or it cannot be made
  explicit NewFolder(const std::filesystem::path& folder);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  /// Where to fill it, absolute.
  const std::filesystem::path& path() const { return path_; }

  /// The same, said of the folder as its user named it, if it is said of a file in it.
  InputError named(const InputError& error) const;

  /// \throw Interrupted by Ctrl-C or a plain kill
  void stopIfInterrupted() const { watch_.stopIfInterrupted(); }

  /// Makes it appear. \throw InputError it cannot, or something is there by now
  void keep();

 private:
  InterruptWatch watch_;
  std::filesystem::path folder_, final_, path_;  // as named, absolute, where it is filled
  bool isKept_ = false;
};

/// Makes a folder, whole or not at all (see NewFolder). \param fill writes the files into the folder it is given
/// \throw InputError the place is refused (see requireNewRunFolder) or cannot be written to;
/// \throw Interrupted by Ctrl-C or a plain kill; nothing is left; and whatever `fill` throws
DEPTHSERVO_API void makeFolder(const std::filesystem::path& folder,
                               const std::function<void(const std::filesystem::path&)>& fill);

/// The same for a file. \throw InputError
DEPTHSERVO_API void requireNewFile(const std::string& file);

/// A file that is written bit by bit, whole or not at all and never over another one: until it is
/// kept it has another name, and without that it is gone again.
class DEPTHSERVO_API NewFile {
 public:
  /// \throw InputError see requireNewFile
  explicit NewFile(std::string file);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  /// \throw Interrupted by Ctrl-C or a plain kill
  void write(std::string_view bytes);
  std::size_t size() const { return size_; }  ///< written so far [byte]

  /// Makes it appear. \throw InputError not all could be written, or there is such a file by now
  void keep();

 private:
  InterruptWatch watch_;
  std::string file_, temporary_;
  std::ofstream stream_;
  std::size_t size_ = 0;
};

/// Writes a file, whole or not at all, and never over another one. \throw InputError
DEPTHSERVO_API void makeFile(const std::string& file, const std::string& text);

/// Replaces a file at once, or makes a new one: whoever fails or is killed leaves the old one.
/// \throw InputError
DEPTHSERVO_API void replaceFile(const std::filesystem::path& file, std::string_view text);

}  // namespace depthservo
