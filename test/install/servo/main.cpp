// Observes depth in a recorded sequence: a point that a camera passes, 2 m away, at 0.2 m/s.
#include <depthservo/rig/RecordedRig.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

namespace {

constexpr double kZ = 2, kSpeed = 0.2, kFocal_px = 600;  // m, m/s

void record(const std::string& folder) {
  std::ofstream camera(folder + "/camera.yaml"), twist(folder + "/twist.csv"),
      tracks(folder + "/tracks.csv");
  camera << "image_width: 640\nimage_height: 480\n"
            "camera_matrix: {rows: 3, cols: 3, data: [600, 0, 319.5, 0, 600, 239.5, 0, 0, 1]}\n"
            "distortion_model: plumb_bob\n"
            "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n";
  twist << "timestamp,vx,vy,vz,wx,wy,wz\n";
  tracks << "timestamp,id,u,v\n";
  for (int k = 0; k < 100; ++k) {
    const double time_s = k / 25.;
    twist << time_s << ',' << kSpeed << ",0,0,0,0,0\n";
    tracks << time_s << ",0," << 400 - kFocal_px * kSpeed * time_s / kZ << ",250\n";
  }
}

}  // namespace

int main() {
  std::string folder = (std::filesystem::temp_directory_path() / "depthservo.XXXXXX").string();
  if (!mkdtemp(folder.data())) return 1;
  record(folder);
  const depthservo::Sequence sequence(folder);
  std::filesystem::remove_all(folder);

  depthservo::RecordedRig rig(sequence, {});
  depthservo::Observer observer(rig.source(), rig.options());
  while (const auto exposure = rig.next(nullptr)) {
    rig.readOdometry(observer.odometry(), exposure->time_s);
    observer.observe(*exposure);
  }
  const double Z = observer.estimator().estimate(0).Z();
  std::cout << "Z " << Z << " m, true " << kZ << " m\n";
  return std::abs(Z / kZ - 1) < 0.01 ? 0 : 1;
}
