#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "depthservo/depth/DepthEstimate.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/motion/MotionBuffer.h"
#include "depthservo/motion/OdometryNoise.h"

namespace depthservo::python {

namespace py = pybind11;

/// Rows of doubles. An array that has this layout is used as it is, any other becomes a copy.
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

constexpr py::ssize_t kAny = -1;

/// Refuses an array of another shape with ValueError: "xy: expected shape (4, 2), got (3, 2)".
/// \param shape kAny: any size along this axis
void requireShape(const Array& array, const char* name, const std::vector<py::ssize_t>& shape);

/// Refuses what is not finite, with ValueError.
double finite(double value, const char* name);

Array arrayOf(const std::vector<double>& values);  ///< (n,)

/// \param twist (6,): vx, vy, vz [m/s], wx, wy, wz [rad/s]
Twist twistOf(const Array& twist, const char* name);
Array arrayOf(const Twist& twist);

/// \throw ValueError a row is not finite or not later than the one before
void push(MotionBuffer& odometry, const Array& times_s, const Array& twists);

/// A depth as a prior. \param sigma_Z none: the wide default
DepthPrior priorOf(double Z, const std::optional<double>& sigma_Z, const DepthRange& range);

/// None: none; a name: typical | arm | poses; or a profile.
std::optional<ErrorProfile> errorsOf(const py::object& errors);

void bindMotion(py::module_& module);
void bindErrors(py::module_& module);
void bindEstimators(py::module_& module);
void bindDepthFilter(py::module_& module);
void bindRecordings(py::module_& module);
void bindRuns(py::module_& module);

}  // namespace depthservo::python
