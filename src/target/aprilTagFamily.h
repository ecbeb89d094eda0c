#pragma once

#include <memory>
#include <string>

extern "C" {
#include <apriltag/apriltag.h>
}

namespace depthservo::detail {

/// Owns a family of libapriltag.
struct AprilTagFamilyDeleter {
  void (*destroy)(apriltag_family_t*);
  void operator()(apriltag_family_t* family) const { destroy(family); }
};
using AprilTagFamily = std::unique_ptr<apriltag_family_t, AprilTagFamilyDeleter>;

/// \throws std::invalid_argument no such family
AprilTagFamily makeAprilTagFamily(const std::string& name);

}  // namespace depthservo::detail
