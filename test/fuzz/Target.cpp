#include "Target.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "depthservo/text/InputError.h"
#include "support/TemporaryFolder.h"

namespace depthservo::fuzz {
namespace {

const test::TemporaryFolder& place() {
  static const test::TemporaryFolder folder;
  return folder;
}

}  // namespace

void require(bool isMet, const char* what) {
  if (isMet) return;
  std::fprintf(stderr, "not as promised: %s\n", what);
  std::abort();
}

void feed(Read read, const std::string& bytes) {
  try {
    read(bytes);
  } catch (const InputError& error) {
    const std::string message = error.what();
    require(!message.empty() && message.size() <= 1000, "a refusal of 1 to 1000 bytes");
    require(std::none_of(message.begin(), message.end(),
                         [](char c) { return static_cast<unsigned char>(c) < 0x20; }),
            "a refusal of one line");
  }
}

std::string written(const std::string& name, const std::string& bytes) {
  place().write(name, bytes);
  return (place() / name).string();
}

std::string folderWith(const std::string& folder, const std::map<std::string, std::string>& files,
                       const std::string& bytes) {
  static std::map<std::string, std::string> changed;  // the file of each folder that is not as given
  const std::filesystem::path path = place() / folder;
  const auto write = [&](const std::string& name, const std::string& content) {
    std::filesystem::create_directories((path / name).parent_path());
    place().write(folder + '/' + name, content);
  };
  if (changed.count(folder) == 0) {
    for (const auto& [name, content] : files) write(name, content);
  } else if (const auto before = files.find(changed[folder]); before != files.end()) {
    write(before->first, before->second);
  }
  const std::size_t end = std::min(bytes.find('\n'), bytes.size());
  const std::string name = bytes.substr(0, end);
  changed[folder] = name;
  if (files.count(name) == 0) throw InputError({name, 0, ""}, "is no file of this folder");
  write(name, bytes.substr(std::min(end + 1, bytes.size())));
  return path.string();
}

}  // namespace depthservo::fuzz
