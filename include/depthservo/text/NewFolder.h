#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>

#include "depthservo/api.h"
#include "depthservo/text/InterruptWatch.h"

namespace depthservo {

/// Refuses a place where no folder can be made: it exists already, or its parent is missing or
/// not writable. Call it before a long run. \throw InputError
DEPTHSERVO_API void requireNewRunFolder(const std::filesystem::path& folder);

/// Makes a folder, whole or not at all: it is filled under another name beside its place and
/// renamed at the end. \param fill writes the files into the folder it is given
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

/// Writes a file, whole or not at all, and never over another one. \param fill writes the file
/// whose name it is given; false: it could not be written \throw InputError
DEPTHSERVO_API void makeFile(const std::string& file,
                             const std::function<bool(const std::string&)>& fill);
DEPTHSERVO_API void makeFile(const std::string& file, const std::string& text);

}  // namespace depthservo
