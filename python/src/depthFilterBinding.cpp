#include <cmath>
#include <utility>

#include "DepthFilter.h"
#include "observation/makeEstimator.h"

namespace depthservo::python {
namespace {

/// DepthFilter as Python sees it: an engine, its odometry, the estimates of the last image.
class DepthFilter {
 public:
  struct Options {
    std::string estimator;
    py::object errors;
    OdometryNoise odometry;
    double pixelNoise_px, focal_px, prior, z_min, z_max, odometryScaleSigma, focalSigma;
    std::optional<double> priorSigma;
    std::vector<std::string> joint;
  };

  DepthFilter(std::size_t size, const Options& options)
      : size_(size), range_{options.z_min, options.z_max}, sigma_(sigmaOf(options)) {
    if (size == 0) throw py::value_error("n: expected at least one point");
    if (!(range_.Z_min > 0 && range_.Z_max > range_.Z_min && std::isfinite(range_.Z_max))) {
      throw py::value_error("z_min, z_max: expected 0 < z_min < z_max [m]");
    }
    engine_ = engineOf(options);
  }

  void push(const Array& times_s, const Array& twists) { python::push(odometry_, times_s, twists); }

  std::string step(double time_s, const Array& xy, const std::optional<Array>& twist,
                   const std::optional<double>& sigma) {
    requireShape(xy, "xy", {static_cast<py::ssize_t>(size_), 2});
    requireLater(time_s);
    const double last_s = engine_->time();
    if (twist && std::isfinite(last_s)) {
      if (!odometry_.push(last_s, twistOf(*twist, "twist"))) {
        throw py::value_error("twist: rows for this time were pushed already; give either");
      }
      odometry_.holdUntil(time_s);
    }
    const Coverage coverage = engine_->advance(odometry_, time_s);
    if (coverage != Coverage::afterEnd) engine_->correct(xy.data(), sigma.value_or(sigma_));
    isFresh_ = false;
    return toString(coverage);
  }

  Estimates observe(const Array& times_s, const Array& xy, const Array& twistTimes_s,
                    const Array& twists) {
    const auto n = static_cast<py::ssize_t>(size_);
    requireShape(times_s, "t", {kAny});
    requireShape(xy, "xy", {times_s.shape(0), n, 2});
    MotionBuffer odometry(static_cast<std::size_t>(std::max<py::ssize_t>(2, twistTimes_s.size())));
    python::push(odometry, twistTimes_s, twists);
    double last_s = engine_->time();
    for (py::ssize_t k = 0; k < times_s.shape(0); ++k) {
      if (!std::isfinite(times_s.at(k)) || times_s.at(k) <= last_s) {
        throw py::value_error("t: image " + std::to_string(k) +
                              " is not later than the one before");
      }
      last_s = times_s.at(k);
    }
    Estimates estimates({times_s.shape(0), n});
    const Estimates::Rows rows = estimates.rows();
    const double* times = times_s.data();
    const double* points = xy.data();
    {
      const py::gil_scoped_release others;
      for (std::size_t k = 0; k < static_cast<std::size_t>(times_s.shape(0)); ++k) {
        if (engine_->advance(odometry, times[k]) != Coverage::afterEnd) {
          engine_->correct(points + 2 * size_ * k, sigma_);
        }
        for (std::size_t i = 0; i < size_; ++i) rows.set(k * size_ + i, engine_->estimate(i));
      }
    }
    isFresh_ = false;
    return estimates;
  }

  void correctDepth(std::size_t i, double z, double sigma_z) {
    requirePoint(i);
    engine_->correctDepth(i, priorOf(z, sigma_z, range_));
    isFresh_ = false;
  }

  void setPrior(std::size_t i, double z, const std::optional<double>& sigma_z) {
    requirePoint(i);
    engine_->setPrior(i, priorOf(z, sigma_z, range_));
  }

  const Estimates& estimates() {
    if (!isFresh_) {
      Estimates now({static_cast<py::ssize_t>(size_)});
      const Estimates::Rows rows = now.rows();
      for (std::size_t i = 0; i < size_; ++i) rows.set(i, engine_->estimate(i));
      estimates_ = std::move(now);
      isFresh_ = true;
    }
    return estimates_;
  }

  /// Name, value, sigma and whether it is known of what the points share.
  py::dict shared() const {
    py::dict result;
    const auto states = engine_->estimator() ? jointStatesOf(*engine_->estimator()) : std::nullopt;
    if (!states) return result;
    const auto add = [&](const char* name, const JointDepthFilter::Common& state) {
      if (state.isEstimated)
        result[name] = py::make_tuple(state.value, state.sigma, state.isObserved);
    };
    add("time_offset", states->timeOffset);
    add("gyro_bias_x", states->gyroBias[0]);
    add("gyro_bias_y", states->gyroBias[1]);
    add("gyro_bias_z", states->gyroBias[2]);
    add("focal", states->focal);
    return result;
  }

  std::size_t size() const { return size_; }
  double time() const { return engine_->time(); }

 private:
  static double sigmaOf(const Options& o) {
    if (!(o.pixelNoise_px > 0 && o.focal_px > 0)) {
      throw py::value_error("pixel_noise, focal: expected numbers above 0 px");
    }
    return o.pixelNoise_px / o.focal_px;
  }

  void requirePoint(std::size_t i) const {
    if (i >= size_)
      throw py::index_error("point " + std::to_string(i) + " of " + std::to_string(size_));
  }

  void requireLater(double time_s) const {
    finite(time_s, "t");
    if (time_s <= engine_->time()) {
      throw py::value_error("t: " + std::to_string(time_s) +
                            " s is not later than the last image's " +
                            std::to_string(engine_->time()) + " s");
    }
  }

  std::unique_ptr<PointEngine> engineOf(const Options& o) const {
    const DepthPrior prior = priorOf(o.prior, o.priorSigma, range_);
    EstimatorSetup setup;
    setup.depth.estimator = estimatorNamed(o.estimator, {"estimator", 0, ""});
    setup.errors = errorsOf(o.errors);
    if (setup.depth.estimator == EstimatorKind::filter && !setup.errors) {
      InverseDepthFilterOptions filter;
      filter.odometry = o.odometry;
      filter.odometryScaleSigma = o.odometryScaleSigma;
      filter.focalSigma = o.focalSigma;
      return std::make_unique<BatchEngine>(size_, filter, prior, range_);
    }
    if (setup.depth.estimator == EstimatorKind::pose ||
        setup.depth.estimator == EstimatorKind::trueDepth) {
      throw py::value_error("estimator: '" + o.estimator +
                            "' needs more than points; use replay() or run()");
    }
    setup.depth.initial = o.prior;
    setup.depth.Z_min = range_.Z_min;
    setup.depth.Z_max = range_.Z_max;
    setup.odometry = o.odometry;
    setup.odometryScaleSigma = o.odometryScaleSigma;
    setup.focalSigma = o.focalSigma;
    setup.sigma = sigma_;
    setup.camera = {640, 480, o.focal_px, o.focal_px, 319.5, 239.5};
    setup.depth.joint = jointOf(o.joint);
    auto engine = std::make_unique<SetEngine>(size_, makeEstimator(setup, size_));
    for (std::size_t i = 0; i < size_; ++i) engine->setPrior(i, prior);
    return engine;
  }

  static JointStateOptions jointOf(const std::vector<std::string>& names) {
    JointStateOptions joint{false, false, false};
    for (const std::string& name : names) {
      bool* state = name == "time_offset" ? &joint.time_offset
                    : name == "gyro_bias" ? &joint.gyro_bias
                    : name == "focal"     ? &joint.focal
                                          : nullptr;
      if (!state) {
        throw py::value_error("joint: expected 'time_offset', 'gyro_bias', 'focal', got '" + name +
                              "'");
      }
      *state = true;
    }
    return joint;
  }

  std::size_t size_;
  DepthRange range_;
  double sigma_;
  MotionBuffer odometry_;
  std::unique_ptr<PointEngine> engine_;
  Estimates estimates_{{0}};
  bool isFresh_ = false;
};

void bindEstimates(py::module_& module) {
  py::class_<Estimates>(module, "Estimates",
                        "Estimates of n points, of one image, (n,), or of T images, (T, n).")
      .def_readonly("xy", &Estimates::xy, "(..., 2): measured, or predicted while hidden [-].")
      .def_readonly("z", &Estimates::z, "Depth [m].")
      .def_readonly("sigma_z", &Estimates::sigma_z, "1 sigma of z, to first order [m].")
      .def_readonly("z_low", &Estimates::z_low, "Near end of the depths within two sigma [m].")
      .def_readonly("z_high", &Estimates::z_high, "Far end; infinite: arbitrarily far [m].")
      .def_readonly("excitation", &Estimates::excitation, "Speed across the line of sight [m/s].")
      .def_readonly("status", &Estimates::status, "uint8, see Status.");
}

}  // namespace

void bindDepthFilter(py::module_& module) {
  bindEstimates(module);
  py::class_<DepthFilter>(module, "DepthFilter",
                          "Depths of n points from their images and the camera's motion.")
      .def(py::init([](std::size_t n, std::string estimator, py::object errors,
                       const OdometryNoise& odometry, double pixelNoise, double focal, double prior,
                       std::optional<double> priorSigma, double z_min, double z_max, double scale,
                       double focalSigma, std::vector<std::string> joint) {
             return std::make_unique<DepthFilter>(
                 n, DepthFilter::Options{std::move(estimator), std::move(errors), odometry,
                                         pixelNoise, focal, prior, z_min, z_max, scale, focalSigma,
                                         priorSigma, std::move(joint)});
           }),
           py::arg("n"), py::kw_only(), py::arg("estimator") = "filter",
           py::arg("errors") = py::none(), py::arg("odometry_noise") = OdometryNoise{},
           py::arg("pixel_noise") = 0.5, py::arg("focal") = 600., py::arg("prior") = 1.,
           py::arg("prior_sigma") = py::none(), py::arg("z_min") = 0.05, py::arg("z_max") = 100.,
           py::arg("odometry_scale_sigma") = 0., py::arg("focal_sigma") = 0.,
           py::arg("joint") = std::vector<std::string>{"time_offset"},
           "n: number of points. estimator: filter | joint | nonlinear | window | two-frame | "
           "constant.\n"
           "errors: lasting errors of the robot: None (white noise alone), 'typical', 'arm', "
           "'poses' or an\n"
           "ErrorProfile. pixel_noise: 1 sigma per axis [px]; focal: focal length [px], which "
           "turns it into\n"
           "normalised coordinates. prior, prior_sigma: first guess of every depth and its sigma "
           "[m]; without\n"
           "a sigma any guess will do. z_min, z_max: depths reported [m]. odometry_scale_sigma, "
           "focal_sigma:\n"
           "relative, 1 sigma [-]. joint: what the joint filter learns besides depths.")
      .def("push_twists", &DepthFilter::push, py::arg("t"), py::arg("twists"),
           "Odometry: t (m,) [s], ascending; twists (m, 6): vx, vy, vz [m/s], wx, wy, wz [rad/s] "
           "of the\n"
           "camera in its own frame. A row holds until the next one's time.")
      .def("step", &DepthFilter::step, py::arg("t"), py::arg("xy"), py::arg("twist") = py::none(),
           py::arg("sigma") = py::none(),
           "One image, taken at t [s]: xy (n, 2), normalised image coordinates [-]; rows of NaN "
           "are hidden.\n"
           "twist: (6,), the camera's since the last image, instead of `push_twists`. sigma: noise "
           "of these\n"
           "points, pixels / focal length [-], instead of pixel_noise / focal. Returns how far the "
           "odometry\n"
           "covers the time since the last image: 'complete', or why it does not.")
      .def("observe", &DepthFilter::observe, py::arg("t"), py::arg("xy"), py::arg("twist_t"),
           py::arg("twists"),
           "Many images at once: t (T,), xy (T, n, 2), twist_t (m,), twists (m, 6). Returns "
           "Estimates, (T, n).\n"
           "Other threads may run meanwhile.")
      .def("correct_depth", &DepthFilter::correctDepth, py::arg("i"), py::arg("z"),
           py::arg("sigma_z"), "A range sensor said of point i that its depth is z +- sigma_z [m].")
      .def("set_prior", &DepthFilter::setPrior, py::arg("i"), py::arg("z"),
           py::arg("sigma_z") = py::none(),
           "Point i starts anew with its next measurement, at the guess z [m].")
      .def("shared", &DepthFilter::shared,
           "What a joint filter has learnt besides depths: name -> (value, sigma, whether it is "
           "known);\n"
           "time_offset [s] (> 0: images are late), gyro_bias_x.. [rad/s], focal (true / given) "
           "[-].")
      .def_property_readonly(
          "estimates", [](DepthFilter& f) { return f.estimates(); },
          "Estimates as of the last image, (n,).")
      .def_property_readonly(
          "xy", [](DepthFilter& f) { return f.estimates().xy; }, "(n, 2) [-].")
      .def_property_readonly(
          "z", [](DepthFilter& f) { return f.estimates().z; }, "(n,) [m].")
      .def_property_readonly(
          "sigma_z", [](DepthFilter& f) { return f.estimates().sigma_z; }, "(n,) [m].")
      .def_property_readonly(
          "z_low", [](DepthFilter& f) { return f.estimates().z_low; }, "(n,) [m].")
      .def_property_readonly(
          "z_high", [](DepthFilter& f) { return f.estimates().z_high; }, "(n,) [m].")
      .def_property_readonly(
          "status", [](DepthFilter& f) { return f.estimates().status; }, "(n,) uint8, see Status.")
      .def_property_readonly("time", &DepthFilter::time,
                             "Of the last image [s]; NaN before the first.")
      .def("__len__", &DepthFilter::size);
}

}  // namespace depthservo::python
