#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "depthservo/text/InputError.h"
#include "sequence/bag/ChunkedBag.h"
#include "text/StrictYaml.h"

namespace depthservo::detail {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

struct BagKind {
  const char* ending;
  std::string_view magic;
  std::unique_ptr<Bag> (*open)(const std::string&);
};

const BagKind kBagKinds[] = {{".mcap", "\x89MCAP"sv, openMcap},
                             {".bag", "#ROSBAG "sv, openRosBag},
                             {".db3", "SQLite format 3\0"sv, openDb3}};

/// By its first bytes, or by its name where they tell nothing; null: it is no bag.
const BagKind* bagKindOf(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return nullptr;
  std::string start(16, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  for (const BagKind& kind : kBagKinds) {
    if (std::string_view(start).substr(0, kind.magic.size()) == kind.magic) return &kind;
  }
  const std::string ending = fs::path(path).extension().string();
  for (const BagKind& kind : kBagKinds) {
    if (ending == kind.ending) return &kind;
  }
  return nullptr;
}

/// The files of a ROS 2 recording in their order, as its metadata.yaml lists them. Throws
/// InputError.
std::vector<std::string> filesOf(const fs::path& folder) {
  const std::string path = (folder / "metadata.yaml").string();
  const YamlValue root = loadYaml(path);
  const YamlValue* info = root.find("rosbag2_bagfile_information");
  const YamlValue* list = info ? info->find("relative_file_paths") : nullptr;
  if (!list || list->items.empty()) {
    throw InputError({path, 0, "rosbag2_bagfile_information.relative_file_paths"},
                     "missing: expected the names of the recording's files; give the .mcap or .db3 "
                     "itself");
  }
  std::vector<std::string> files;
  for (const YamlValue& item : list->items) {
    const std::string file = (folder / fs::path(item.scalar).filename()).string();
    if (fs::path(file).extension() == ".zstd") {
      throw InputError({file, 0, ""}, "is packed as a file; unpack it first: zstd -d FILE");
    }
    files.push_back(file);
  }
  return files;
}

/// The files of one recording as one bag.
class JoinedBag : public Bag {
 public:
  explicit JoinedBag(const std::vector<std::string>& files) {
    for (const std::string& file : files) {
      const BagKind* kind = bagKindOf(file);
      if (!kind) {
        throw InputError({file, 0, ""}, "is missing or no bag, and metadata.yaml lists it");
      }
      bags_.push_back(kind->open(file));
    }
    join();
  }

  std::vector<std::string> warnings() const override {
    std::vector<std::string> all;
    for (const auto& bag : bags_) {
      for (std::string& warning : bag->warnings()) all.push_back(std::move(warning));
    }
    return all;
  }

  void visit(BagVisitor& visitor) override {
    for (std::size_t i = 0; i < bags_.size(); ++i) {
      PartVisitor part(*this, static_cast<std::uint32_t>(i), visitor);
      bags_[i]->visit(part);
    }
    join();
  }

  std::string read(const MessagePlace& place) override { return bags_[place.file]->read(place); }

 private:
  struct PartVisitor : BagVisitor {
    PartVisitor(JoinedBag& bag, std::uint32_t i, BagVisitor& all)
        : whole(bag), file(i), visitor(all) {}
    std::size_t wanted(const BagTopic& topic) const override { return visitor.wanted(topic); }
    void visit(const BagMessage& message) override {
      BagMessage renamed = message;
      renamed.topic = whole.placeOf(whole.bags_[file]->topics()[message.topic]);
      renamed.place.file = file;
      visitor.visit(renamed);
    }
    JoinedBag& whole;
    std::uint32_t file;
    BagVisitor& visitor;
  };

  std::size_t placeOf(const BagTopic& topic) {
    const auto same = std::find_if(topics_.begin(), topics_.end(), [&](const BagTopic& other) {
      return other.name == topic.name && other.type == topic.type;
    });
    if (same != topics_.end()) return static_cast<std::size_t>(same - topics_.begin());
    topics_.push_back(topic);
    return topics_.size() - 1;
  }

  void join() {
    for (const auto& bag : bags_) {
      for (const BagTopic& topic : bag->topics()) placeOf(topic);
    }
  }

  std::vector<std::unique_ptr<Bag>> bags_;
};

}  // namespace

bool isBagPath(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return bagKindOf(path) != nullptr;
  const fs::path metadata = fs::path(path) / "metadata.yaml";
  if (!fs::is_regular_file(metadata, error) || fs::exists(fs::path(path) / "rgb.txt", error)) {
    return false;
  }
  std::string start(4096, '\0');
  std::ifstream file(metadata, std::ios::binary);
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  return start.find("rosbag2_bagfile_information") != std::string::npos;
}

std::unique_ptr<Bag> openBag(const std::string& path) {
  if (const BagKind* kind = bagKindOf(path)) return kind->open(path);
  return std::make_unique<JoinedBag>(filesOf(path));
}

std::string printable(std::string_view name) {
  constexpr std::size_t kMost = 200;
  std::string shown(name.substr(0, kMost));
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return shown;
}

std::string plainType(const std::string& type) {
  const std::size_t middle = type.find("/msg/");
  return middle == std::string::npos ? type : type.substr(0, middle) + type.substr(middle + 4);
}

}  // namespace depthservo::detail
