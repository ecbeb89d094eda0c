#pragma once

#include <map>
#include <string>
#include <utility>

namespace depthservo::fuzz {

/// Hands bytes to one reader of files, as if somebody had given them to the tool.
/// \throw InputError they are refused; nothing else may happen to them
using Read = void (*)(const std::string& bytes);

/// All readers of this program, by name: files in seeds/<name> and crashes/<name> are of it.
inline std::map<std::string, Read>& targets() {
  static std::map<std::string, Read> all;
  return all;
}

/// A target is a file of its own that says `const Target kName("name", [](const std::string& bytes) {...})`.
struct Target {
  Target(const char* name, Read read) { targets()[name] = read; }
};

/// Aborts, as a sanitizer would.
void require(bool isMet, const char* what);

/// Hands bytes to a reader; refusals must be one line of at most 1000 bytes.
void feed(Read read, const std::string& bytes);

/// A file of this name in a folder of this program; its path. Always the same folder.
std::string written(const std::string& name, const std::string& bytes);

/// Bytes whose first line names a file of `folder`, the others are what stands in it: the other files
/// are as they are given here. Names that are not there are refused. \return path of the folder
std::string folderWith(const std::string& folder, const std::map<std::string, std::string>& files,
                       const std::string& bytes);

}  // namespace depthservo::fuzz
