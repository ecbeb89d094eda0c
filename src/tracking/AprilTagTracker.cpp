#include "depthservo/tracking/AprilTagTracker.h"

#include <map>

#include "depthservo/visp/using.h"
#include "target/aprilTagFamily.h"
#include "text/require.h"
#include "tracking/TagCorners.h"

namespace depthservo {
namespace {

/// libapriltag's own corners, when a tag is too small to measure its sides [px].
constexpr double kUnrefinedSigma_px = 0.5;

/// Between ink and paper [gray levels]: less is taken for noise, which is slow to search.
constexpr int kLeastTagContrast = 20;

struct DetectorDeleter {
  void operator()(apriltag_detector_t* detector) const { apriltag_detector_destroy(detector); }
};
struct DetectionsDeleter {
  void operator()(zarray_t* detections) const { apriltag_detections_destroy(detections); }
};

}  // namespace

class AprilTagTracker::Impl {
 public:
  Impl(const std::string& family, const AprilTagTrackerOptions& options)
      : options_(options),
        family_(detail::makeAprilTagFamily(family)),
        detector_(apriltag_detector_create()) {
    detail::require("AprilTagTracker", options.hamming >= 0 && options.hamming <= 2,
                    "hamming is 0..2");
    detail::require("AprilTagTracker",
                    options.decision_margin >= 0 && options.decision_margin <= 255,
                    "decision_margin is 0..255");
    detail::require("AprilTagTracker", options.decimate >= 1 && options.decimate <= 8,
                    "decimate is 1..8");
    apriltag_detector_add_family_bits(detector_.get(), family_.get(), options.hamming);
    detector_->nthreads = 1;
    detector_->quad_decimate = static_cast<float>(options.decimate);
    detector_->qtp.min_white_black_diff = kLeastTagContrast;
  }

  void setTags(const AprilTagTarget& target) {
    detail::require("AprilTagTracker", !target.tags.empty(), "no tag");
    for (const AprilTagTarget::Tag& tag : target.tags) {
      detail::require("AprilTagTracker",
                      tag.id >= 0 && static_cast<std::uint32_t>(tag.id) < family_->ncodes,
                      "the family " + target.family + " has no tag " + std::to_string(tag.id));
      const int index = static_cast<int>(indices_.size());
      detail::require("AprilTagTracker", indices_.emplace(tag.id, index).second,
                      "the tag " + std::to_string(tag.id) + " is there twice");
    }
    hasTarget_ = true;
  }

  const std::vector<TrackedPoint>& track(const vpImage<unsigned char>& image) {
    points_.clear();
    if (image.getSize() == 0 || image.bitmap == nullptr) return points_;
    const int width = static_cast<int>(image.getWidth());
    image_u8_t view = {width, static_cast<int>(image.getHeight()), width, image.bitmap};
    const std::unique_ptr<zarray_t, DetectionsDeleter> detections(
        apriltag_detector_detect(detector_.get(), &view));
    seen_.clear();
    for (int k = 0; k < zarray_size(detections.get()); ++k) {
      apriltag_detection_t* detection = nullptr;
      zarray_get(detections.get(), k, &detection);
      add(image, *detection);
    }
    for (const auto& [index, tag] : seen_) {
      if (tag.count > 1) continue;
      points_.insert(points_.end(), tag.corners.begin(), tag.corners.end());
    }
    return points_;
  }

 private:
  struct SeenTag {
    int count = 0;  // in this image
    std::array<TrackedPoint, 4> corners;
  };

  void add(const vpImage<unsigned char>& image, const apriltag_detection_t& detection) {
    if (static_cast<double>(detection.decision_margin) < options_.decision_margin) return;
    int index = detection.id;
    if (hasTarget_) {
      const auto known = indices_.find(detection.id);
      if (known == indices_.end()) return;
      index = known->second;
    }
    std::array<Eigen::Vector2d, 4> rough;
    for (std::size_t j = 0; j < 4; ++j) {
      // For libapriltag (0, 0) is the outer corner of the first pixel.
      rough[j] = Eigen::Vector2d(detection.p[j][0] - 0.5, detection.p[j][1] - 0.5);
      if (!rough[j].allFinite()) return;
    }
    const auto fine = detail::refineTagCorners(image, rough, family_->width_at_border);
    SeenTag& tag = seen_[index];
    ++tag.count;
    for (std::size_t j = 0; j < 4; ++j) {
      const Eigen::Vector2d& p = fine ? fine->corners[j] : rough[j];
      tag.corners[j] = {4 * index + static_cast<int>(j), p.x(), p.y(),
                        fine ? fine->sigma_px[j] : kUnrefinedSigma_px};
    }
  }

  AprilTagTrackerOptions options_;
  detail::AprilTagFamily family_;  // outlives the detector, which uses it
  std::unique_ptr<apriltag_detector_t, DetectorDeleter> detector_;
  bool hasTarget_ = false;
  std::map<int, int> indices_;   // in the target, by the tag's id
  std::map<int, SeenTag> seen_;  // in the image at hand, by index
  std::vector<TrackedPoint> points_;
};

AprilTagTracker::AprilTagTracker(const std::string& family, const AprilTagTrackerOptions& options)
    : impl_(std::make_unique<Impl>(family, options)) {}

AprilTagTracker::AprilTagTracker(const AprilTagTarget& target,
                                 const AprilTagTrackerOptions& options)
    : impl_(std::make_unique<Impl>(target.family, options)) {
  impl_->setTags(target);
}

AprilTagTracker::AprilTagTracker(AprilTagTracker&&) noexcept = default;
AprilTagTracker& AprilTagTracker::operator=(AprilTagTracker&&) noexcept = default;
AprilTagTracker::~AprilTagTracker() = default;

const std::vector<TrackedPoint>& AprilTagTracker::track(const vpImage<unsigned char>& image,
                                                        const std::vector<ExpectedPoint>&) {
  return impl_->track(image);
}

}  // namespace depthservo
