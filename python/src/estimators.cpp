#include <cmath>
#include <optional>

#include "binding.h"
#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/TwoFrameLeastSquares.h"
#include "depthservo/depth/WindowDepthEstimator.h"

namespace depthservo::python {
namespace {

DepthRange rangeOf(double z_min, double z_max) {
  if (!(z_min > 0 && z_max > z_min && std::isfinite(z_max))) {
    throw py::value_error("z_min, z_max: expected 0 < z_min < z_max [m]");
  }
  return {z_min, z_max};
}

PointMeasurement measurementOf(const Array& xy, double sigma) {
  requireShape(xy, "xy", {2});
  return {xy.at(0), xy.at(1), sigma};
}

InverseDepthFilter inverseDepthFilter(const OdometryNoise& odometry, const py::object& errors,
                                      double focal, double scale, double z_min, double z_max) {
  const auto profile = errorsOf(errors);
  InverseDepthFilterOptions options = profile
                                          ? InverseDepthFilterOptions::considering(*profile, focal)
                                          : InverseDepthFilterOptions{};
  if (!profile) {
    options.odometry = odometry;
    options.odometryScaleSigma = scale;
  }
  return InverseDepthFilter(options, rangeOf(z_min, z_max));
}

void bindEstimate(py::module_& module) {
  py::class_<DepthEstimate>(module, "DepthEstimate",
                            "A point with its depth and what that is worth.")
      .def_readonly("x", &DepthEstimate::x, "Normalised image coordinate [-].")
      .def_readonly("y", &DepthEstimate::y, "Normalised image coordinate [-].")
      .def_property_readonly("z", &DepthEstimate::Z, "Depth [m].")
      .def_property_readonly("sigma_z", &DepthEstimate::sigma_Z,
                             "1 sigma of z, to first order [m].")
      .def_property_readonly(
          "z_low", [](const DepthEstimate& e) { return e.interval().low; },
          "Near end of the depths within two sigma [m].")
      .def_property_readonly(
          "z_high", [](const DepthEstimate& e) { return e.interval().high; },
          "Far end; infinite while the point may be arbitrarily far [m].")
      .def_readonly("chi", &DepthEstimate::chi, "Inverse depth [1/m].")
      .def_readonly("sigma_chi", &DepthEstimate::sigma_chi, "1 sigma of chi [1/m].")
      .def_readonly("sigma_xy", &DepthEstimate::sigma_xy, "1 sigma of x and of y [-].")
      .def_readonly("excitation", &DepthEstimate::excitation,
                    "Speed across the line of sight [m/s].")
      .def_property_readonly(
          "status", [](const DepthEstimate& e) { return toString(e.status); },
          "unset | converging | valid | unexcited | coasting | rejected | lost.")
      .def("__repr__", [](const DepthEstimate& e) {
        return "DepthEstimate(z=" + std::to_string(e.Z()) +
               ", sigma_z=" + std::to_string(e.sigma_Z()) + ", status='" + toString(e.status) +
               "')";
      });
}

void bindEstimator(py::module_& module) {
  py::class_<DepthEstimator>(module, "DepthEstimator",
                             "One point. `reset` with the first measurement, then for each image "
                             "`predict` with the motion\n"
                             "since the last, and `correct` if the point was seen.")
      .def(
          "reset",
          [](DepthEstimator& self, const Array& xy, double sigma, double z,
             const std::optional<double>& sigma_z) {
            self.reset(measurementOf(xy, sigma), priorOf(z, sigma_z, DepthRange{}));
          },
          py::arg("xy"), py::arg("sigma"), py::arg("z") = 1., py::arg("sigma_z") = py::none(),
          "xy: (2,), normalised [-]; sigma: its noise, pixels / focal length [-]; z: first guess "
          "[m],\n"
          "sigma_z: of it [m], None: so wide that it has no lasting influence.")
      .def("predict", &DepthEstimator::predict, py::arg("motion"), "The camera has moved.")
      .def(
          "correct",
          [](DepthEstimator& self, const Array& xy, double sigma) {
            self.correct(measurementOf(xy, sigma));
          },
          py::arg("xy"), py::arg("sigma"), "The point was seen at xy, (2,) [-].")
      .def(
          "correct_depth",
          [](DepthEstimator& self, double z, double sigma_z) {
            self.correctDepth(priorOf(z, sigma_z, DepthRange{}));
          },
          py::arg("z"), py::arg("sigma_z"), "A range sensor said z +- sigma_z [m].")
      .def("estimate", &DepthEstimator::estimate, "A copy of what is believed now.");
}

}  // namespace

DepthPrior priorOf(double Z, const std::optional<double>& sigma_Z, const DepthRange& range) {
  if (!(Z > 0 && std::isfinite(Z))) throw py::value_error("z: expected a depth above 0 m");
  DepthPrior prior{Z};
  if (sigma_Z) {
    if (!(*sigma_Z > 0)) throw py::value_error("sigma_z: expected a number above 0 m, or None");
    prior.sigma_chi = *sigma_Z / (Z * Z);
  }
  return prior.sanitised(range);
}

void bindEstimators(py::module_& module) {
  bindEstimate(module);
  bindEstimator(module);
  const auto z_min = py::arg("z_min") = 0.05, z_max = py::arg("z_max") = 100.;
  py::class_<InverseDepthFilter, DepthEstimator>(
      module, "InverseDepthFilter", "Extended Kalman filter of (x, y, 1/Z): the default.")
      .def(py::init(&inverseDepthFilter), py::kw_only(),
           py::arg("odometry_noise") = OdometryNoise{}, py::arg("errors") = py::none(),
           py::arg("focal") = 600., py::arg("odometry_scale_sigma") = 0., z_min, z_max,
           "errors: None (white noise: odometry_noise, odometry_scale_sigma [-]), 'typical', "
           "'arm',\n"
           "'poses' or an ErrorProfile. focal: focal length [px]. z_min, z_max: depths reported "
           "[m].");
  py::class_<NonlinearDepthObserver, DepthEstimator>(
      module, "NonlinearDepthObserver", "De Luca, Oriolo, Robuffo Giordano, IJRR 2008.")
      .def(py::init([](double settling, double W_min, const OdometryNoise& odometry, double low,
                       double high) {
             NonlinearObserverOptions options;
             options.gains = ObserverGains::scheduled(settling, W_min);
             options.odometry = odometry;
             return NonlinearDepthObserver(options, rangeOf(low, high));
           }),
           py::kw_only(), py::arg("settling") = 1.5, py::arg("min_excitation") = 0.01,
           py::arg("odometry_noise") = OdometryNoise{}, z_min, z_max,
           "settling: time to 2 % [s]; min_excitation: below it gains stop growing [m/s].");
  py::class_<WindowDepthEstimator, DepthEstimator>(
      module, "WindowDepthEstimator",
      "Least squares over a window of images (Durand Petiteville et al. 2010).")
      .def(py::init([](double spacing, double low, double high) {
             WindowOptions options;
             options.spacing_s = spacing;
             return WindowDepthEstimator(options, rangeOf(low, high));
           }),
           py::kw_only(), py::arg("spacing") = 0.1, z_min, z_max,
           "spacing: between images kept [s].");
  py::class_<TwoFrameLeastSquares, DepthEstimator>(module, "TwoFrameLeastSquares",
                                                   "Triangulation of two images: a baseline.")
      .def(py::init(
               [](double low, double high) { return TwoFrameLeastSquares(rangeOf(low, high)); }),
           py::kw_only(), z_min, z_max);
  py::class_<ConstantDepth, DepthEstimator>(module, "ConstantDepth",
                                            "The guess, for ever: a baseline.")
      .def(py::init([](double low, double high) { return ConstantDepth(rangeOf(low, high)); }),
           py::kw_only(), z_min, z_max);
}

}  // namespace depthservo::python
