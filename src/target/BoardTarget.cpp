#include "depthservo/target/BoardTarget.h"

#include <stdexcept>

#include "motion/DecimalPoint.h"
#include "target/arucoDictionary.h"

namespace depthservo {
namespace {

struct DictionaryEntry {
  const char* name;
  cv::aruco::PREDEFINED_DICTIONARY_NAME dictionary;
};

constexpr DictionaryEntry kDictionaries[] = {{"4x4_50", cv::aruco::DICT_4X4_50},
                                             {"4x4_100", cv::aruco::DICT_4X4_100},
                                             {"4x4_250", cv::aruco::DICT_4X4_250},
                                             {"4x4_1000", cv::aruco::DICT_4X4_1000},
                                             {"5x5_50", cv::aruco::DICT_5X5_50},
                                             {"5x5_100", cv::aruco::DICT_5X5_100},
                                             {"5x5_250", cv::aruco::DICT_5X5_250},
                                             {"5x5_1000", cv::aruco::DICT_5X5_1000},
                                             {"6x6_50", cv::aruco::DICT_6X6_50},
                                             {"6x6_100", cv::aruco::DICT_6X6_100},
                                             {"6x6_250", cv::aruco::DICT_6X6_250},
                                             {"6x6_1000", cv::aruco::DICT_6X6_1000},
                                             {"7x7_50", cv::aruco::DICT_7X7_50},
                                             {"7x7_100", cv::aruco::DICT_7X7_100},
                                             {"7x7_250", cv::aruco::DICT_7X7_250},
                                             {"7x7_1000", cv::aruco::DICT_7X7_1000},
                                             {"original", cv::aruco::DICT_ARUCO_ORIGINAL},
                                             {"apriltag_16h5", cv::aruco::DICT_APRILTAG_16h5},
                                             {"apriltag_25h9", cv::aruco::DICT_APRILTAG_25h9},
                                             {"apriltag_36h10", cv::aruco::DICT_APRILTAG_36h10},
                                             {"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11}};

/// A marker with its black border, each cell of a gray level, without a margin.
GrayPatch markerPatch(const BoardTarget::Markers& markers, int id, unsigned char ink,
                      unsigned char paper) {
  const auto dictionary = detail::arucoDictionary(markers.dictionary);
  const int cells = dictionary->markerSize + 2;
  cv::Mat bits;
  dictionary->drawMarker(id, cells, bits, 1);
  GrayPatch patch{Eigen::Isometry3d::Identity(), markers.size, markers.size, cells, cells, {}};
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      patch.gray.push_back(bits.at<unsigned char>(row, column) < 128 ? ink : paper);
    }
  }
  return patch;
}

}  // namespace

cv::Ptr<cv::aruco::Dictionary> detail::arucoDictionary(const std::string& name) {
  std::string names;
  for (const DictionaryEntry& entry : kDictionaries) {
    if (name == entry.name) return cv::aruco::getPredefinedDictionary(entry.dictionary);
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw std::invalid_argument("there is no ArUco dictionary '" + name + "'; expected " + names);
}

std::vector<std::string> arucoDictionaries() {
  std::vector<std::string> names;
  for (const DictionaryEntry& entry : kDictionaries) names.emplace_back(entry.name);
  return names;
}

int arucoMarkerCount(const std::string& dictionary) {
  return detail::arucoDictionary(dictionary)->bytesList.rows;
}

std::string BoardTarget::objection() const {
  for (const int corners : {columns, rows}) {
    if (corners >= kLeast && corners <= kMost) continue;
    return "a board has " + std::to_string(kLeast) + " to " + std::to_string(kMost) +
           " inner corners in a row or a column, not " + std::to_string(corners);
  }
  if (!markers) return "";
  if (!square) return "a ChArUco board needs the side of its squares";
  constexpr double kLeastMarker = 0.3, kMostMarker = 0.95;  // of a square
  const double share = markers->size / *square;
  if (!(share >= kLeastMarker && share <= kMostMarker)) {
    const DecimalPoint point;
    return "the side of a marker is 0.3 to 0.95 of that of a square, not " + std::to_string(share);
  }
  const int printed = arucoMarkerCount(markers->dictionary);
  if (markerCount() <= printed) return "";
  return "the board has " + std::to_string(markerCount()) + " markers, the dictionary " +
         markers->dictionary + " " + std::to_string(printed);
}

std::vector<Eigen::Vector3d> BoardTarget::corners() const {
  if (!square) throw std::logic_error("BoardTarget: the side of its squares is not known");
  std::vector<Eigen::Vector3d> corners;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      corners.emplace_back(*square * (c - 0.5 * (columns - 1)), *square * (r - 0.5 * (rows - 1)),
                           0);
    }
  }
  return corners;
}

std::vector<GrayPatch> BoardTarget::patches(unsigned char ink, unsigned char paper) const {
  if (!square) throw std::logic_error("BoardTarget: the side of its squares is not known");
  std::vector<GrayPatch> patches;
  int marker = 0;
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      const bool isBlack = (r + c) % 2 == 0;
      if (!isBlack && !markers) continue;
      patches.push_back(
          isBlack ? GrayPatch{Eigen::Isometry3d::Identity(), *square, *square, 1, 1, {ink}}
                  : markerPatch(*markers, marker++, ink, paper));
      patches.back().oMp.translation() << *square * (c - 0.5 * columns), *square * (r - 0.5 * rows),
          0;
    }
  }
  return patches;
}

}  // namespace depthservo
