#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include "binding.h"
#include "depthservo/sequence/RecordingInfo.h"
#include "depthservo/sequence/Sequence.h"

namespace depthservo::python {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Each row of (n, 2) by a function of two numbers.
template <class F>
Array eachRow(const Array& points, const char* name, const F& f) {
  requireShape(points, name, {kAny, 2});
  const py::ssize_t n = points.shape(0);
  Array result({n, py::ssize_t{2}});
  for (py::ssize_t i = 0; i < n; ++i) {
    const Eigen::Vector2d p = f(points.at(i, 0), points.at(i, 1));
    result.mutable_at(i, 0) = p.x();
    result.mutable_at(i, 1) = p.y();
  }
  return result;
}

void bindCamera(py::module_& module) {
  py::class_<PinholeCamera>(
      module, "Camera",
      "Pinhole camera with lens distortion; pixel (0, 0) is the centre of the first.")
      .def(py::init([](int width, int height, double fx, double fy, double cx, double cy) {
             return PinholeCamera{width, height, fx, fy, cx, cy};
           }),
           py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"), py::arg("cx"),
           py::arg("cy"), "All in pixels.")
      .def_static("read", &loadCamera, py::arg("file"),
                  "A camera_info file, or tum-fr1 | tum-fr2 | tum-fr3 | icl.")
      .def_readonly("width", &PinholeCamera::width)
      .def_readonly("height", &PinholeCamera::height)
      .def_readonly("fx", &PinholeCamera::fx)
      .def_readonly("fy", &PinholeCamera::fy)
      .def_readonly("cx", &PinholeCamera::cx)
      .def_readonly("cy", &PinholeCamera::cy)
      .def_property_readonly(
          "focal", [](const PinholeCamera& c) { return c.focal_px(); },
          "Pixels a unit of normalised coordinates [px].")
      .def(
          "normalise",
          [](const PinholeCamera& c, const Array& uv) {
            return eachRow(uv, "uv", [&](double u, double v) { return c.normalise(u, v); });
          },
          py::arg("uv"),
          "Normalised coordinates (n, 2) [-] of pixels (n, 2), freed from distortion.")
      .def(
          "to_pixel",
          [](const PinholeCamera& c, const Array& xy) {
            return eachRow(xy, "xy", [&](double x, double y) { return c.toPixel(x, y); });
          },
          py::arg("xy"), "Pixels (n, 2) of normalised coordinates (n, 2).");
}

SequenceOptions optionsOf(const std::string& camera, double fps,
                          const std::vector<std::string>& topics, const std::string& target,
                          const std::optional<std::vector<double>>& cameraInBase) {
  SequenceOptions options;
  options.camera = camera;
  options.fps = fps;
  options.topics = topics;
  options.target = target;
  if (cameraInBase) {
    if (cameraInBase->size() != 6) {
      throw py::value_error("camera_in_base: expected x, y, z [m], roll, pitch, yaw [rad]");
    }
    const auto& p = *cameraInBase;
    options.cameraInBase = RpyPose{{p[0], p[1], p[2]}, {p[3], p[4], p[5]}};
  }
  return options;
}

/// Row by row. \param value of the row
template <class Rows, class F>
Array column(const Rows& rows, const F& value) {
  Array result(static_cast<py::ssize_t>(rows.size()));
  double* out = result.mutable_data();
  for (const auto& row : rows) *out++ = value(row);
  return result;
}

Array twistsOf(const Sequence& sequence) {
  Array result({static_cast<py::ssize_t>(sequence.odometry().size()), py::ssize_t{6}});
  double* out = result.mutable_data();
  for (const OdometryRow& row : sequence.odometry()) {
    const Vector6d twist = row.twist.vector();
    out = std::copy(twist.data(), twist.data() + 6, out);
  }
  return result;
}

Array posesOf(const Sequence& sequence) {
  Array result({static_cast<py::ssize_t>(sequence.poses().size()), py::ssize_t{4}, py::ssize_t{4}});
  double* out = result.mutable_data();
  for (const CameraPose& pose : sequence.poses()) {
    for (int i = 0; i < 16; ++i) *out++ = pose.wMc.matrix()(i / 4, i % 4);
  }
  return result;
}

/// Place of every id that is in a frame's tracks or truth, ascending.
std::map<int, py::ssize_t> placesOf(const Sequence& sequence) {
  std::map<int, py::ssize_t> places;
  for (const SequenceFrame& frame : sequence.frames()) {
    for (const PixelPoint& point : frame.tracks) places[point.id] = 0;
    for (const TrueDepth& depth : frame.truth) places[depth.id] = 0;
  }
  py::ssize_t next = 0;
  for (auto& [id, place] : places) place = next++;
  return places;
}

py::array_t<int> idsOf(const Sequence& sequence) {
  const auto places = placesOf(sequence);
  py::array_t<int> ids(static_cast<py::ssize_t>(places.size()));
  for (const auto& [id, place] : places) ids.mutable_at(place) = id;
  return ids;
}

Array tracksOf(const Sequence& sequence) {
  const auto places = placesOf(sequence);
  const auto images = static_cast<py::ssize_t>(sequence.frames().size());
  Array result({images, static_cast<py::ssize_t>(places.size()), py::ssize_t{2}});
  std::fill_n(result.mutable_data(), result.size(), kNaN);
  for (py::ssize_t k = 0; k < images; ++k) {
    for (const PixelPoint& point : sequence.frames()[static_cast<std::size_t>(k)].tracks) {
      result.mutable_at(k, places.at(point.id), 0) = point.u;
      result.mutable_at(k, places.at(point.id), 1) = point.v;
    }
  }
  return result;
}

Array truthOf(const Sequence& sequence) {
  const auto places = placesOf(sequence);
  const auto images = static_cast<py::ssize_t>(sequence.frames().size());
  Array result({images, static_cast<py::ssize_t>(places.size())});
  std::fill_n(result.mutable_data(), result.size(), kNaN);
  for (py::ssize_t k = 0; k < images; ++k) {
    for (const TrueDepth& depth : sequence.frames()[static_cast<std::size_t>(k)].truth) {
      result.mutable_at(k, places.at(depth.id)) = depth.Z;
    }
  }
  return result;
}

/// The bytes of the image itself: the array owns it.
py::array_t<unsigned char> imageOf(const Sequence& sequence, std::size_t frame) {
  using Image = DEPTHSERVO_VISP vpImage<unsigned char>;
  if (frame >= sequence.frames().size()) {
    throw py::index_error("image " + std::to_string(frame) + " of " +
                          std::to_string(sequence.frames().size()));
  }
  std::unique_ptr<Image> image;
  {
    const py::gil_scoped_release others;
    image = std::make_unique<Image>(sequence.readImage(frame));
  }
  const auto rows = static_cast<py::ssize_t>(image->getHeight());
  const auto columns = static_cast<py::ssize_t>(image->getWidth());
  unsigned char* bytes = image->bitmap;
  const py::capsule owner(image.release(), [](void* owned) { delete static_cast<Image*>(owned); });
  return py::array_t<unsigned char>({rows, columns}, bytes, owner);
}

void bindSequence(py::module_& module) {
  py::class_<Sequence>(module, "Sequence",
                       "Recorded data: images or tracks, odometry, poses, truth.")
      .def(py::init([](const std::string& path, const std::string& camera, double fps,
                       const std::vector<std::string>& topics, const std::string& target,
                       const std::optional<std::vector<double>>& base) {
             const SequenceOptions options = optionsOf(camera, fps, topics, target, base);
             const py::gil_scoped_release others;
             return std::make_unique<Sequence>(path, options);
           }),
           py::arg("path"), py::kw_only(), py::arg("camera") = "", py::arg("fps") = 0.,
           py::arg("topics") = std::vector<std::string>{}, py::arg("target") = "",
           py::arg("camera_in_base") = py::none(),
           "path: a folder (ours, TUM, ICL-NUIM, EuRoC, numbered images) or a ROS 1 or 2 bag. "
           "camera: a\n"
           "file or preset. fps: of numbered images [Hz]. topics: of a bag, "
           "'image=/camera/image_raw'.\n"
           "target: a YAML file. camera_in_base: x, y, z [m], roll, pitch, yaw [rad] of the camera "
           "in the\n"
           "frame of the twists. ValueError when it cannot be used.")
      .def_property_readonly("name", &Sequence::name)
      .def_property_readonly("path", &Sequence::folder)
      .def_property_readonly("camera", &Sequence::camera)
      .def_property_readonly("warnings", &Sequence::warnings, "What was ignored or assumed.")
      .def_property_readonly(
          "times",
          [](const Sequence& s) {
            return column(s.frames(), [](const auto& f) { return f.time_s; });
          },
          "Of the images, (T,) [s].")
      .def_property_readonly(
          "twist_times",
          [](const Sequence& s) {
            return column(s.odometry(), [](const auto& r) { return r.time_s; });
          },
          "Of the odometry, (m,) [s].")
      .def_property_readonly("twists", &twistsOf,
                             "(m, 6) of the camera in its own frame [m/s, rad/s].")
      .def_property_readonly(
          "pose_times",
          [](const Sequence& s) {
            return column(s.poses(), [](const auto& p) { return p.time_s; });
          },
          "Of the poses, (k,) [s].")
      .def_property_readonly("poses", &posesOf, "Of the camera in the world, (k, 4, 4) [m].")
      .def_property_readonly("ids", &idsOf, "Of the points with tracks or truth, (n,), ascending.")
      .def_property_readonly("tracks", &tracksOf, "Measured pixels by id, (T, n, 2); NaN: hidden.")
      .def_property_readonly("truth", &truthOf, "True depths by id, (T, n) [m]; NaN: unknown.")
      .def_property_readonly("has_images", &Sequence::hasImages)
      .def("image", &imageOf, py::arg("i"), "Gray image i, (height, width) uint8; not copied.")
      .def("__len__", [](const Sequence& s) { return s.frames().size(); });
}

py::dict topicOf(const RecordedTopic& topic) {
  py::dict d;
  d["name"] = topic.name;
  d["type"] = topic.type;
  d["use"] = topic.use;
  d["messages"] = topic.messages;
  d["rate"] = topic.rate_hz;
  d["gaps"] = topic.gaps.size();
  d["frames"] = topic.frames;
  return d;
}

}  // namespace

void bindRecordings(py::module_& module) {
  bindCamera(module);
  bindSequence(module);
  module.def(
      "describe_recording",
      [](const std::string& path, const std::string& camera, double fps,
         const std::vector<std::string>& topics) {
        const RecordingInfo info =
            describeRecording(path, optionsOf(camera, fps, topics, "", std::nullopt));
        py::dict d;
        d["path"] = info.path;
        d["kind"] = info.kind;
        d["notes"] = info.notes;
        d["missing"] = info.missing;
        py::list all;
        for (const RecordedTopic& topic : info.topics) all.append(topicOf(topic));
        d["topics"] = all;
        return d;
      },
      py::arg("path"), py::kw_only(), py::arg("camera") = "", py::arg("fps") = 0.,
      py::arg("topics") = std::vector<std::string>{},
      "What is in a bag or a folder: kind, topics (name, type, use, messages, rate [Hz]), notes, "
      "and why it\n"
      "cannot be replayed (missing; empty: it can).");
}

}  // namespace depthservo::python
