#include <cmath>

#include "binding.h"
#include "depth/statusNames.h"
#include "depthservo/text/InputError.h"

namespace depthservo::python {

void requireShape(const Array& array, const char* name, const std::vector<py::ssize_t>& shape) {
  const auto written = [](const std::vector<py::ssize_t>& sizes) {
    std::string text = "(";
    for (const py::ssize_t size : sizes) {
      text += (text.size() > 1 ? ", " : "") + (size == kAny ? "n" : std::to_string(size));
    }
    return text + (sizes.size() == 1 ? ",)" : ")");
  };
  const std::vector<py::ssize_t> got(array.shape(), array.shape() + array.ndim());
  bool fits = got.size() == shape.size();
  for (std::size_t i = 0; fits && i < shape.size(); ++i) {
    fits = shape[i] == kAny || shape[i] == got[i];
  }
  if (!fits) {
    throw py::value_error(std::string(name) + ": expected shape " + written(shape) + ", got " +
                          written(got));
  }
}

double finite(double value, const char* name) {
  if (!std::isfinite(value)) {
    throw py::value_error(std::string(name) + ": expected a finite number, got " +
                          std::to_string(value));
  }
  return value;
}

Array arrayOf(const std::vector<double>& values) {
  return Array(static_cast<py::ssize_t>(values.size()), values.data());
}

Twist twistOf(const Array& twist, const char* name) {
  requireShape(twist, name, {6});
  const double* v = twist.data();
  for (int i = 0; i < 6; ++i) finite(v[i], name);
  return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

Array arrayOf(const Twist& twist) { return Array(6, twist.vector().eval().data()); }

}  // namespace depthservo::python

PYBIND11_MODULE(_core, module) {
  using namespace depthservo::python;
  module.doc() = "The parts of depthservo that are C++. Use `import depthservo`.";
  py::register_exception<depthservo::InputError>(module, "InputError", PyExc_ValueError);
  module.attr("STATUS_NAMES") = py::tuple(py::cast(depthservo::statusNames()));
  module.attr("__version__") = DEPTHSERVO_VERSION;
  bindMotion(module);
  bindErrors(module);
  bindEstimators(module);
  bindDepthFilter(module);
  bindRecordings(module);
  bindRuns(module);
}
