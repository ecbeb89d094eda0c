#include <cmath>
#include <optional>

#include "binding.h"
#include "depthservo/depth/CramerRaoBound.h"
#include "depthservo/scenario/observationOf.h"

namespace depthservo::python {
namespace {

OdometryMode modeNamed(const std::string& mode) {
  if (mode == "measured") return OdometryMode::measured;
  if (mode == "commanded") return OdometryMode::commanded;
  throw py::value_error("mode: expected 'measured' or 'commanded', got '" + mode + "'");
}

/// Relative sigma of the depths, image by image.
struct Bound {
  CramerRaoBound bound;
  const MotionBuffer& odometry;
  OdometryNoise noise;
  double sigma;
};

Array relativeSigmas(Bound& b, const Array& times_s, const std::optional<Array>& seen,
                     py::ssize_t n) {
  const py::ssize_t images = times_s.shape(0);
  Array result({images, n});
  for (py::ssize_t k = 0; k < images; ++k) {
    if (k > 0) {
      const auto [motion, coverage] = b.odometry.motion(times_s.at(k - 1), times_s.at(k));
      if (coverage != Coverage::complete) {
        throw py::value_error("twists: they do not cover image " + std::to_string(k) + ": " +
                              toString(coverage));
      }
      b.bound.advance(motion, b.noise);
    }
    for (py::ssize_t i = 0; i < n; ++i) {
      const auto point = static_cast<std::size_t>(i);
      if (!seen || seen->at(k, i) != 0) b.bound.measure(point, b.sigma);
      result.mutable_at(k, i) = b.bound.relativeSigma(point);
    }
  }
  return result;
}

Array cramerRaoBound(const Array& points, const Array& times_s, const MotionBuffer& odometry,
                     double sigma, const OdometryNoise& noise, const std::optional<Array>& seen,
                     const py::object& errors, double focal, double sigma_chi) {
  requireShape(points, "points", {kAny, 3});
  requireShape(times_s, "t", {kAny});
  const py::ssize_t n = points.shape(0);
  if (seen) requireShape(*seen, "seen", {times_s.shape(0), n});
  if (!(sigma > 0))
    throw py::value_error("sigma: expected a number above 0 (pixels / focal length)");
  std::vector<PointState> states;
  for (py::ssize_t i = 0; i < n; ++i) {
    states.push_back({finite(points.at(i, 0), "points"), finite(points.at(i, 1), "points"),
                      finite(points.at(i, 2), "points")});
  }
  Bound b{CramerRaoBound(states, sigma_chi, errorsOf(errors).value_or(ErrorProfile{}), focal),
          odometry, noise, sigma};
  return relativeSigmas(b, times_s, seen, n);
}

void bindOdometryNoise(py::module_& module) {
  py::class_<OdometryNoise>(module, "OdometryNoise",
                            "White noise of twists, per row and axis (1 sigma).")
      .def(
          py::init([](double v, double w, double relative_v, double relative_w,
                      const std::string& mode) {
            return OdometryNoise{v, w, relative_v, relative_w, modeNamed(mode)};
          }),
          py::arg("sigma_v") = 0.002, py::arg("sigma_w") = 0.001, py::arg("relative_v") = 0.01,
          py::arg("relative_w") = 0.01, py::arg("mode") = "measured",
          "sigma_v [m/s], sigma_w [rad/s]: floors; relative_v, relative_w [-]: shares of the "
          "speed.\n"
          "mode: 'measured' (the noise is in the twists) or 'commanded' (in what the camera does).")
      .def_static("exact", &OdometryNoise::none, "Odometry without any error.")
      .def_readwrite("sigma_v", &OdometryNoise::sigma_v)
      .def_readwrite("sigma_w", &OdometryNoise::sigma_w)
      .def_readwrite("relative_v", &OdometryNoise::relative_v)
      .def_readwrite("relative_w", &OdometryNoise::relative_w);
}

}  // namespace

std::optional<ErrorProfile> errorsOf(const py::object& errors) {
  if (errors.is_none()) return std::nullopt;
  if (!py::isinstance<py::str>(errors)) return errors.cast<ErrorProfile>();
  const auto name = errors.cast<std::string>();
  if (name == "typical") return ErrorProfile::typical();
  if (name == "arm") return ErrorProfile::arm();
  if (name == "poses") return ErrorProfile::poses();
  throw py::value_error(
      "errors: expected None, 'typical', 'arm', 'poses' or an ErrorProfile, got '" + name + "'");
}

void bindErrors(py::module_& module) {
  bindOdometryNoise(module);
  py::class_<GaussMarkov>(module, "GaussMarkov", "An error that lasts for a while.")
      .def_readwrite("sigma", &GaussMarkov::sigma, "1 sigma, in the unit of what errs.")
      .def_readwrite("tau", &GaussMarkov::tau_s, "Correlation time [s]; 0: white.");
  py::class_<ErrorProfile>(module, "ErrorProfile",
                           "How large the lasting errors of a robot may be, 1 sigma each; 0: none.")
      .def(py::init<>())
      .def_static("typical", &ErrorProfile::typical, "A wheeled robot with a gyro.")
      .def_static("arm", &ErrorProfile::arm, "An arm with a camera mounted by hand.")
      .def_static("poses", &ErrorProfile::poses, "Motion from poses.")
      .def_static("read", &readErrorProfile, py::arg("file"),
                  "From a file that `depthservo calibrate` wrote.")
      .def_readwrite("scale", &ErrorProfile::scale, "Relative error of the translation [-].")
      .def_readwrite("slip", &ErrorProfile::slip, "Likewise, but for a while [-].")
      .def_readwrite("gyro_bias", &ErrorProfile::gyroBias_rad_s, "[rad/s], per axis.")
      .def_readwrite("odometry", &ErrorProfile::odometry, "White noise of the rows.")
      .def_readwrite("latency", &ErrorProfile::latency_s, "Of images against odometry [s].")
      .def_readwrite("jitter", &ErrorProfile::jitter_s, "Of the images' stamps [s].")
      .def_readwrite("readout", &ErrorProfile::readout_s, "Of a rolling shutter [s].")
      .def_readwrite("focal", &ErrorProfile::focal, "Relative error of the focal length [-].")
      .def_readwrite("mount", &ErrorProfile::mount_rad,
                     "Rotation of the camera's mount [rad], per axis.")
      .def_readwrite("wander", &ErrorProfile::wander_px, "Of each point's tracker [px].")
      .def_readwrite("position", &ErrorProfile::position_m, "Of poses [m].")
      .def_readwrite("angle", &ErrorProfile::angle_rad, "Of poses [rad].");

  module.def(
      "cramer_rao_bound", &cramerRaoBound, py::arg("points"), py::arg("t"), py::arg("odometry"),
      py::kw_only(), py::arg("sigma"), py::arg("odometry_noise") = OdometryNoise{},
      py::arg("seen") = py::none(), py::arg("errors") = py::none(), py::arg("focal") = 600.,
      py::arg("sigma_chi") = std::numeric_limits<double>::infinity(),
      "Least sigma_Z / Z [-] that any estimator can have: (T, n).\n\n"
      "points: (n, 3), true x, y [-], chi [1/m] in the first image; one point: the bound of\n"
      "estimators that treat points alone, several: of joint ones. t: (T,) times of the images "
      "[s].\n"
      "odometry: MotionBuffer with the true twists. sigma: noise of a point, pixels / focal "
      "length.\n"
      "seen: (T, n), 0 where a point is hidden. errors: lasting ones, as of DepthFilter.\n"
      "sigma_chi: prior knowledge [1/m].");
}

}  // namespace depthservo::python
