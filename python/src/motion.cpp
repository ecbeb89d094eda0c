#include <Eigen/Geometry>
#include <limits>

#include "binding.h"
#include "depthservo/observation/words.h"
#include "motion/rateByTwist.h"

namespace depthservo::python {
namespace {

Eigen::Isometry3d poseOf(const Array& pose, const char* name) {
  requireShape(pose, name, {4, 4});
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) result.matrix()(i, j) = finite(pose.at(i, j), name);
  }
  return result;
}

Array rotationOf(const Motion& motion) {
  Array R({3, 3});
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R.mutable_at(i, j) = motion.R(i, j);
  }
  return R;
}

Array flowOf(const Motion& motion, const Array& points) {
  requireShape(points, "points", {kAny, 3});
  const py::ssize_t n = points.shape(0);
  Array result({n, py::ssize_t{3}});
  const double* p = points.data();
  double* out = result.mutable_data();
  for (py::ssize_t i = 0; i < n; ++i, p += 3, out += 3) {
    const Flow moved = flow(motion, {p[0], p[1], p[2]});
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    out[0] = moved.ahead ? moved.point.x : unknown;
    out[1] = moved.ahead ? moved.point.y : unknown;
    out[2] = moved.ahead ? moved.point.chi : unknown;
  }
  return result;
}

Array interactionMatrix(const Array& xy, const Array& z) {
  requireShape(xy, "xy", {kAny, 2});
  const py::ssize_t n = xy.shape(0);
  requireShape(z, "z", {n});
  Array result({2 * n, py::ssize_t{6}});
  double* out = result.mutable_data();
  for (py::ssize_t i = 0; i < n; ++i) {
    if (!(z.at(i) > 0)) throw py::value_error("z: every depth must be > 0 m");
    const auto L = rateByTwist({xy.at(i, 0), xy.at(i, 1), 1 / z.at(i)});
    for (int row = 0; row < 2; ++row) {
      for (int column = 0; column < 6; ++column) *out++ = L(row, column);
    }
  }
  return result;
}

}  // namespace

void push(MotionBuffer& odometry, const Array& times_s, const Array& twists) {
  requireShape(times_s, "t", {kAny});
  requireShape(twists, "twists", {times_s.shape(0), 6});
  const double* v = twists.data();
  for (py::ssize_t i = 0; i < times_s.shape(0); ++i, v += 6) {
    if (!odometry.push(times_s.at(i), {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}})) {
      throw py::value_error(
          "twists: row " + std::to_string(i) +
          " is not finite, faster than 1e4 m/s or rad/s, or not later than the row before it");
    }
  }
}

void bindMotion(py::module_& module) {
  py::class_<Motion>(
      module, "Motion",
      "What the camera's own motion does to a still point: p_now = R p_before + t.\n\n"
      "Camera frame: x right, y down, z forward.")
      .def(py::init<>(), "No motion, of no duration.")
      .def_static(
          "from_twist",
          [](const Array& twist, double dt) {
            return Motion::fromTwist(twistOf(twist, "twist"), finite(dt, "dt"));
          },
          py::arg("twist"), py::arg("dt"),
          "Of a camera that keeps `twist`, (6,): vx, vy, vz [m/s], wx, wy, wz [rad/s] in the "
          "camera\n"
          "frame, for `dt` [s]. Exact for any angle.")
      .def_static(
          "from_poses",
          [](const Array& before, const Array& now, double dt) {
            return Motion::fromPoses(poseOf(before, "before"), poseOf(now, "now"),
                                     finite(dt, "dt"));
          },
          py::arg("before"), py::arg("now"), py::arg("dt"),
          "Between two poses of the camera in the world, (4, 4) each [m], `dt` [s] apart.")
      .def_property_readonly("R", &rotationOf, "Rotation, (3, 3).")
      .def_property_readonly(
          "t", [](const Motion& m) { return Array(3, m.t.data()); }, "Translation, (3,) [m].")
      .def_readonly("dt", &Motion::dt, "Duration [s].")
      .def("then", &Motion::then, py::arg("next"), "This motion, then `next`.")
      .def("inverse", &Motion::inverse, "The motion back; dt changes sign.")
      .def(
          "twist", [](const Motion& m) { return arrayOf(m.twist()); },
          "The constant twist that makes it in dt, (6,) [m/s, rad/s].");

  module.def("flow", &flowOf, py::arg("motion"), py::arg("points"),
             "Where a motion takes still points: exact, no integration.\n\n"
             "points: (n, 3), rows x, y (normalised image coordinates [-]) and chi = 1/Z [1/m].\n"
             "Returns (n, 3) likewise; a row of NaN for a point that passes behind the camera.");
  module.def(
      "interaction_matrix", &interactionMatrix, py::arg("xy"), py::arg("z"),
      "Interaction matrix of points: d(x, y)/dt = L twist.\n\n"
      "xy: (n, 2), normalised [-]; z: (n,) [m], > 0. Returns (2 n, 6), rows x, y of each point.");

  py::class_<MotionBuffer>(
      module, "MotionBuffer",
      "Timestamped twists of the camera at any rate, and its motion between any two\n"
      "instants. A twist holds until the next one's time.")
      .def(py::init([](std::size_t capacity, const std::string& rows) {
             MotionBuffer buffer(capacity);
             buffer.setMeaning(rowMeaningNamed(rows, {"rows", 0, ""}));
             return buffer;
           }),
           py::arg("capacity") = 1024, py::arg("rows") = "hold",
           "capacity: rows kept. rows: what a row is: 'hold' (mean until the next), 'instant' (a\n"
           "sample) or 'mean-before'.")
      .def(
          "push",
          [](MotionBuffer& self, const Array& t, const Array& twists) { push(self, t, twists); },
          py::arg("t"), py::arg("twists"),
          "Adds rows: t (m,) [s], ascending; twists (m, 6) [m/s, rad/s].")
      .def(
          "motion",
          [](const MotionBuffer& self, double from, double to) {
            const auto interval = self.motion(from, to);
            return py::make_tuple(interval.motion, toString(interval.coverage));
          },
          py::arg("t0"), py::arg("t1"),
          "(Motion, coverage) from t0 to t1 [s]; coverage is 'complete', or why it is not known.")
      .def("__len__", &MotionBuffer::size);
}

}  // namespace depthservo::python
