#include "depthservo/target/AprilTagTarget.h"

#include <algorithm>
#include <stdexcept>

#include "target/aprilTagFamily.h"

extern "C" {
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>
}

namespace depthservo {
namespace {

struct FamilyEntry {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr FamilyEntry kFamilies[] = {
    {"36h11", tag36h11_create, tag36h11_destroy},
    {"25h9", tag25h9_create, tag25h9_destroy},
    {"16h5", tag16h5_create, tag16h5_destroy},
    {"36h10", tag36h10_create, tag36h10_destroy},
    {"Standard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
    {"Standard52h13", tagStandard52h13_create, tagStandard52h13_destroy},
    {"Circle21h7", tagCircle21h7_create, tagCircle21h7_destroy},
    {"Custom48h12", tagCustom48h12_create, tagCustom48h12_destroy},
};

struct ImageDeleter {
  void operator()(image_u8_t* image) const { image_u8_destroy(image); }
};

}  // namespace

detail::AprilTagFamily detail::makeAprilTagFamily(const std::string& name) {
  for (const FamilyEntry& entry : kFamilies) {
    if (name == entry.name) return {entry.create(), AprilTagFamilyDeleter{entry.destroy}};
  }
  std::string names;
  for (const std::string& known : aprilTagFamilies()) names += (names.empty() ? "" : ", ") + known;
  throw std::invalid_argument("there is no AprilTag family '" + name + "'; expected " + names);
}

std::vector<std::string> aprilTagFamilies() {
  std::vector<std::string> names;
  for (const FamilyEntry& entry : kFamilies) names.emplace_back(entry.name);
  return names;
}

int aprilTagCount(const std::string& family) {
  return static_cast<int>(detail::makeAprilTagFamily(family)->ncodes);
}

bool AprilTagTarget::hasSizes() const {
  return std::all_of(tags.begin(), tags.end(), [](const Tag& tag) { return tag.size.has_value(); });
}

std::array<Eigen::Vector3d, 4> AprilTagTarget::unitCorners() {
  return {Eigen::Vector3d{-0.5, 0.5, 0}, {0.5, 0.5, 0}, {0.5, -0.5, 0}, {-0.5, -0.5, 0}};
}

std::vector<Eigen::Vector3d> AprilTagTarget::corners() const {
  if (!hasSizes()) throw std::logic_error("AprilTagTarget: a tag's size is not known");
  std::vector<Eigen::Vector3d> corners;
  for (const Tag& tag : tags) {
    for (const Eigen::Vector3d& corner : unitCorners())
      corners.push_back(tag.oMt * (*tag.size * corner));
  }
  return corners;
}

std::vector<GrayPatch> AprilTagTarget::patches(unsigned char ink, unsigned char paper) const {
  if (!hasSizes()) throw std::logic_error("AprilTagTarget: a tag's size is not known");
  std::vector<GrayPatch> patches;
  for (const Tag& tag : tags) {
    GrayPatch patch = aprilTagBitmap(family, tag.id, *tag.size);
    patch.oMp = tag.oMt;
    for (unsigned char& gray : patch.gray) gray = gray < 128 ? ink : paper;
    patches.push_back(std::move(patch));
  }
  return patches;
}

GrayPatch aprilTagBitmap(const std::string& family, int id, double size) {
  const detail::AprilTagFamily tags = detail::makeAprilTagFamily(family);
  if (id < 0 || static_cast<std::uint32_t>(id) >= tags->ncodes) {
    throw std::invalid_argument("AprilTag family " + family + " has the ids 0 to " +
                                std::to_string(tags->ncodes - 1) + ", not " + std::to_string(id));
  }
  const std::unique_ptr<image_u8_t, ImageDeleter> image(
      apriltag_to_image(tags.get(), static_cast<std::uint32_t>(id)));
  GrayPatch patch;
  patch.columns = image->width;
  patch.rows = image->height;
  patch.width = patch.height = size * tags->total_width / tags->width_at_border;
  for (int row = 0; row < image->height; ++row) {
    const std::uint8_t* begin = image->buf + row * image->stride;
    patch.gray.insert(patch.gray.end(), begin, begin + image->width);
  }
  return patch;
}

}  // namespace depthservo
