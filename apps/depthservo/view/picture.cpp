#include "picture.h"

#include <cairo.h>
#include <fmt/format.h>
#include <visp3/core/vpImageConvert.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

struct Colour {
  double red, green, blue;
};
// Okabe and Ito 2008.
constexpr Colour kBlack{0, 0, 0}, kMeasured{0, 0.447, 0.698}, kPredicted{0.902, 0.624, 0};

constexpr double kLine_px = 18;    // between lines of text
constexpr double kLetter_px = 13;  // size of the font

Colour colourOf(const FeatureRecord& feature) { return feature.measured ? kMeasured : kPredicted; }

/// More points than that share one line of text, have no labels, and ways of their last images
/// only.
bool areMany(const std::vector<FeatureRecord>& features) { return features.size() > 12; }

/// Not of points that nobody has seen yet, nor of those predicted far away.
bool hasPlace(const FeatureRecord& feature) {
  constexpr double kFar_px = 1e5;
  return std::abs(feature.u) < kFar_px && std::abs(feature.v) < kFar_px;
}

/// Draws into an image in place; (0, 0) is the centre of its first pixel.
class Pen {
 public:
  explicit Pen(vpImage<vpRGBa>& image)
      : surface_(cairo_image_surface_create_for_data(
                     reinterpret_cast<unsigned char*>(image.bitmap), CAIRO_FORMAT_RGB24,
                     static_cast<int>(image.getWidth()), static_cast<int>(image.getHeight()),
                     static_cast<int>(4 * image.getWidth())),
                 cairo_surface_destroy),
        cairo_(cairo_create(surface_.get()), cairo_destroy) {
    cairo_translate(cairo_.get(), 0.5, 0.5);
    const std::unique_ptr<cairo_font_options_t, void (*)(cairo_font_options_t*)> gray(
        cairo_font_options_create(), cairo_font_options_destroy);
    cairo_font_options_set_antialias(gray.get(), CAIRO_ANTIALIAS_GRAY);
    cairo_set_font_options(cairo_.get(), gray.get());
    cairo_select_font_face(cairo_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo_.get(), kLetter_px);
  }
  ~Pen() { cairo_surface_flush(surface_.get()); }
  Pen(const Pen&) = delete;
  Pen& operator=(const Pen&) = delete;

  void moveTo(double u, double v) { cairo_move_to(cairo_.get(), u, v); }
  void lineTo(double u, double v) { cairo_line_to(cairo_.get(), u, v); }
  void stroke(const Colour& colour, double width) {
    take(colour);
    cairo_set_line_width(cairo_.get(), width);
    cairo_stroke(cairo_.get());
  }
  void circle(double u, double v, const Colour& colour) {
    constexpr double kRadius_px = 8;
    cairo_new_sub_path(cairo_.get());
    cairo_arc(cairo_.get(), u, v, kRadius_px, 0, 2 * M_PI);
    stroke(colour, 2);
  }
  void dot(double u, double v, const Colour& colour) {
    constexpr double kRadius_px = 4;
    cairo_arc(cairo_.get(), u, v, kRadius_px, 0, 2 * M_PI);
    take(colour);
    cairo_fill(cairo_.get());
  }
  void cross(double u, double v, double arm, double width) {
    moveTo(u - arm, v);
    lineTo(u + arm, v);
    moveTo(u, v - arm);
    lineTo(u, v + arm);
    stroke(kBlack, width);
  }
  double widthOf(const std::string& text) {
    cairo_text_extents_t extents;
    cairo_text_extents(cairo_.get(), text.c_str(), &extents);
    return extents.x_advance;
  }
  void text(double u, double v, const std::string& words) {
    take(kBlack);
    moveTo(u, v);
    cairo_show_text(cairo_.get(), words.c_str());
  }
  /// Legible on any image, in the colour of its point.
  void label(double u, double v, const std::string& words, const Colour& colour) {
    moveTo(u, v);
    cairo_text_path(cairo_.get(), words.c_str());
    take({1, 1, 1});
    cairo_set_line_width(cairo_.get(), 3);
    cairo_stroke_preserve(cairo_.get());
    take(colour);
    cairo_fill(cairo_.get());
  }
  /// A light strip for a line of text.
  void strip(double from, double to, double row) {
    cairo_rectangle(cairo_.get(), from, row - 0.75 * kLine_px, to - from, kLine_px);
    cairo_set_source_rgba(cairo_.get(), 1, 1, 1, 0.85);
    cairo_fill(cairo_.get());
  }

 private:
  /// vpRGBa has red and blue where cairo has blue and red.
  void take(const Colour& c) { cairo_set_source_rgb(cairo_.get(), c.blue, c.green, c.red); }

  std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface_;
  std::unique_ptr<cairo_t, void (*)(cairo_t*)> cairo_;
};

/// The way of every dot so far, in steps of a few pixels.
void drawPaths(Pen& pen, const std::vector<FrameRecord>& frames, bool measured) {
  constexpr double kStep_px = 4;
  std::map<int, Eigen::Vector2d> drawnTo;
  const std::size_t longest = areMany(frames.back().features) ? 60 : 900;  // images
  const std::size_t first = frames.size() > longest ? frames.size() - longest : 0;
  for (std::size_t k = first; k < frames.size(); ++k) {
    for (const FeatureRecord& feature : frames[k].features) {
      if (!hasPlace(feature)) continue;
      const Eigen::Vector2d here(feature.u, feature.v);
      const auto [last, isFirst] = drawnTo.try_emplace(feature.id, here);
      if (isFirst || (last->second - here).norm() < kStep_px) continue;
      if (feature.measured == measured) {
        pen.moveTo(last->second.x(), last->second.y());
        pen.lineTo(here.x(), here.y());
      }
      last->second = here;
    }
  }
  pen.stroke(measured ? kMeasured : kPredicted, 1);
}

/// Words on a strip, with a dot of a colour before them or without.
void write(Pen& pen, double row, const std::string& words, const Colour* dot = nullptr) {
  constexpr double kLeft_px = 6, kMargin_px = 5, kDot_px = 14;
  const double from = kLeft_px + kMargin_px + (dot ? kDot_px : 0);
  pen.strip(kLeft_px, from + pen.widthOf(words) + kMargin_px, row);
  if (dot) pen.dot(kLeft_px + kMargin_px + 4, row - 4.5, *dot);
  pen.text(from, row, words);
}

/// What the colours mean.
void drawLegend(Pen& pen, double right, double row, bool hasGoals) {
  constexpr double kMark_px = 14, kGap_px = 12;
  const std::pair<const char*, const Colour*> entries[] = {
      {"measured", &kMeasured}, {"predicted", &kPredicted}, {"goal", nullptr}};
  const std::size_t count = hasGoals ? 3 : 2;
  double from = right;
  for (std::size_t i = 0; i < count; ++i) {
    from -= kMark_px + pen.widthOf(entries[i].first) + kGap_px;
  }
  pen.strip(from - 5, right, row);
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [word, colour] = entries[i];
    colour ? pen.dot(from + 4, row - 4.5, *colour) : pen.cross(from + 4, row - 4.5, 5, 1.5);
    pen.text(from + kMark_px, row, word);
    from += kMark_px + pen.widthOf(word) + kGap_px;
  }
}

/// A line for each point or, of many, one for all.
void drawDepths(Pen& pen, double bottom, const std::vector<FeatureRecord>& features) {
  const auto isKnown = [](const DepthEstimate& e) { return 2 * e.sigma_Z() < e.Z(); };
  if (areMany(features)) {
    const auto known = std::count_if(features.begin(), features.end(),
                                     [&](const FeatureRecord& f) { return isKnown(f.estimate); });
    return write(pen, bottom, fmt::format("{} points, {} depths known", features.size(), known));
  }
  double row = bottom - kLine_px * (static_cast<double>(features.size()) - 1);
  for (const FeatureRecord& feature : features) {
    const DepthEstimate& e = feature.estimate;
    std::string Z = "Z not known";
    if (isKnown(e)) {
      const double twoSigma = 2 * e.sigma_Z();
      const int digits = std::clamp(1 - static_cast<int>(std::floor(std::log10(twoSigma))), 0, 4);
      Z = fmt::format("Z {:.{}f} \u00b1 {:.{}f} m", e.Z(), digits, twoSigma, digits);
    }
    const Colour colour = colourOf(feature);
    write(pen, row, fmt::format("{}:  {}  {}", feature.id, Z, toString(e.status)), &colour);
    row += kLine_px;
  }
}

}  // namespace

void draw(const vpImage<unsigned char>& image, const FrameRecord& record, const RunLog& log,
          const std::string& status, vpImage<vpRGBa>& picture) {
  constexpr double kFirstRow_px = 20, kGoal_px = 8;
  vpImageConvert::convert(image, picture);
  Pen pen(picture);
  for (const Eigen::Vector2d& goal : log.goals) pen.cross(goal.x(), goal.y(), kGoal_px, 1);
  drawPaths(pen, log.frames, true);
  drawPaths(pen, log.frames, false);
  for (const FeatureRecord& feature : record.features) {
    if (!hasPlace(feature)) continue;
    const Colour colour = colourOf(feature);
    pen.circle(feature.u, feature.v, colour);
    if (areMany(record.features)) continue;
    pen.label(feature.u + 11, feature.v - 7, fmt::format("{}", feature.id), colour);
  }
  drawDepths(pen, image.getHeight() - 12., record.features);
  drawLegend(pen, image.getWidth() - 6., kFirstRow_px, !log.goals.empty());
  std::string head = fmt::format("t {:.2f} s", record.time_s - log.frames.front().time_s);
  if (std::isfinite(record.error_px))
    head += fmt::format("   image error {:.1f} px", record.error_px);
  write(pen, kFirstRow_px, head);
  if (!status.empty()) write(pen, kFirstRow_px + kLine_px, status);
}

}  // namespace depthservo
