#include "scenarioFile.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "depthservo/text/InputError.h"
#include "depthservo/text/didYouMean.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

bool isFolder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

/// Where they are: beside an installed tool, else in the source tree it was built in or
/// that it is called in. Empty: nowhere.
fs::path shippedFolder(const fs::path& kind) {
  std::error_code error;
  const fs::path tool = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = tool.parent_path().parent_path() / "share/depthservo" / kind;
  if (isFolder(installed)) return installed;
  std::vector<fs::path> trees;
  for (fs::path at = tool; at.has_relative_path();) trees.push_back(at = at.parent_path());
  trees.push_back(fs::current_path(error));
  for (const fs::path& tree : trees) {
    if (isFolder(tree / "data" / kind)) return tree / "data" / kind;
  }
  return {};
}

std::vector<std::string> namesIn(const fs::path& folder) {
  std::error_code error;
  std::vector<std::string> names;
  if (folder.empty()) return names;  // nothing is shipped
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (it->path().extension() != ".yaml") continue;
    names.push_back(it->path().lexically_relative(folder).replace_extension().string());
  }
  if (error) throw InputError({folder.string(), 0, ""}, "cannot be read: " + error.message());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

std::vector<std::string> shippedNames(const std::string& folder) {
  return namesIn(shippedFolder(folder));
}

std::string pathOrShipped(const std::string& path) {
  std::error_code error;
  const std::string inTree = "data/";
  if (path.rfind(inTree, 0) != 0 || fs::exists(path, error)) return path;
  const fs::path relative = path.substr(inTree.size());
  const fs::path kind = *relative.begin();
  const fs::path shipped = shippedFolder(kind).parent_path() / relative;
  return fs::exists(shipped, error) ? shipped.string() : path;
}

std::string scenarioFile(const std::string& name) { return shippedFile(name, "scenarios"); }

std::string shippedFile(const std::string& name, const std::string& kind) {
  std::error_code error;
  const bool isFile = kind == "sweeps" ? fs::is_regular_file(name, error) : fs::exists(name, error);
  if (isFile) return name;  // a sweep may have a folder of results of its name beside
  if (const std::string shipped = pathOrShipped(name); shipped != name) return shipped;
  const fs::path folder = shippedFolder(kind);
  const std::vector<std::string> shipped = namesIn(folder);
  if (std::find(shipped.begin(), shipped.end(), name) != shipped.end()) {
    return (folder / (name + ".yaml")).string();
  }
  std::string hint = didYouMeanFile(name);
  if (hint.empty()) hint = didYouMean(name, shipped);
  if (hint.empty() && name.find('=') != std::string::npos) hint = "; a key is set by --set " + name;
  throw InputError({name, 0, ""}, "there is no such file, nor a " +
                                      kind.substr(0, kind.size() - 1) + " of this name" + hint);
}

}  // namespace depthservo
