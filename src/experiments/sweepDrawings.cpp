#include "experiments/sweepDrawings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "experiments/sweepMetrics.h"
#include "report/Html.h"

namespace depthservo {
namespace {

constexpr double kLetter_px = 6.6;  // width of a letter of 12 px, about
constexpr double kLine_px = 16;
constexpr const char* kFaint = "#5f6368";

std::string textAt(double x, double y, const std::string& anchor, const std::string& text,
                   const std::string& more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y,
                     anchor, more, html::escaped(text));
}

std::string lineFrom(double x1, double y1, double x2, double y2, const std::string& stroke,
                     double width = 1) {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" "
      "stroke-width=\"{:g}\"/>\n",
      x1, y1, x2, y2, stroke, width);
}

std::string box(double x, double y, double width, double height, const std::string& fill) {
  return fmt::format(
      "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\"/>\n", x, y,
      width, height, fill);
}

double widthOf(const std::string& text) { return kLetter_px * static_cast<double>(text.size()); }

double widest(const std::vector<std::string>& labels) {
  double width = 0;
  for (const std::string& label : labels) width = std::max(width, widthOf(label));
  return width;
}

/// Every so many labels fit side by side.
std::size_t stepOf(const std::vector<std::string>& labels, double place_px) {
  return static_cast<std::size_t>(std::max(1., std::ceil((widest(labels) + 6) / place_px)));
}

/// The runs at one place of a map.
using Counts = std::map<std::string, std::size_t>;

/// One map: outcomes by place.
class MapDrawing {
 public:
  MapDrawing(const SweepTable& table, const SweepScale& x, const SweepScale& y)
      : table_(table), x_(x), y_(y), counts_(x.size() * y.size()) {
    constexpr double kMost_px = 330;
    cell_.width = std::clamp(kMost_px / static_cast<double>(x.size()), 22., 56.);
    cell_.height = std::clamp(260 / static_cast<double>(y.size()), 20., 32.);
    left_ = std::max(kLine_px, widest(y.labels) + 10) + kLine_px;
  }

  void add(std::size_t result) {
    const std::size_t x = x_.places.at(table_.cell(result, table_.column(xName)));
    const std::size_t y = y_.places.at(table_.cell(result, table_.column(yName)));
    ++counts_[y * x_.size() + x][table_.results()[result].outcome];
  }

  Drawing drawn(const std::string& title) const {
    Drawing drawing;
    drawing.width = left_ + cell_.width * static_cast<double>(x_.size()) + 8;
    drawing.width = std::max(drawing.width, widthOf(title) + 16);
    const double bottom = top() + cell_.height * static_cast<double>(y_.size());
    drawing.height = bottom + 2 * kLine_px + 8;
    if (!title.empty()) {
      drawing.elements += textAt(left_, kLine_px, "start", title, " font-weight=\"600\"");
    }
    for (std::size_t y = 0; y < y_.size(); ++y) {
      for (std::size_t x = 0; x < x_.size(); ++x) drawing.elements += place(x, y);
    }
    drawing.elements += axes(bottom);
    return drawing;
  }

  std::string xName, yName;

 private:
  struct Size {
    double width, height;
  };

  static double top() { return kLine_px + 10; }

  /// Numbers grow upwards, words read downwards.
  double topOf(std::size_t y) const {
    const std::size_t row = y_.isOfNumbers() ? y_.size() - 1 - y : y;
    return top() + cell_.height * static_cast<double>(row);
  }

  std::string place(std::size_t x, std::size_t y) const {
    const Counts& counts = counts_[y * x_.size() + x];
    const double left = left_ + cell_.width * static_cast<double>(x), top = topOf(y);
    const Size inner{cell_.width - 1, cell_.height - 1};
    std::size_t runs = 0, successes = 0;
    for (const auto& [outcome, count] : counts) {
      runs += count;
      successes += table_.isSuccess(outcome) ? count : 0;
    }
    if (runs == 0) return box(left, top, inner.width, inner.height, "#f4f4f4");
    std::string elements = "<g><title>";
    elements += html::escaped(fmt::format("{}: {}, {}: {}: ", x_.title, x_.labels[x], y_.title,
                                          y_.labels[y]));
    std::string parts;
    double from = left;
    for (const std::string& outcome : outcomeNames()) {
      const auto found = counts.find(outcome);
      if (found == counts.end()) continue;
      elements += fmt::format("{} {} ", found->second, outcome);
      const double width =
          inner.width * static_cast<double>(found->second) / static_cast<double>(runs);
      parts += box(from, top, width, inner.height, colourOf(outcome).fill);
      from += width;
    }
    elements += "</title>" + parts;
    if (runs > 1) elements += percent(left + inner.width / 2, top + inner.height / 2, successes, runs);
    return elements + "</g>\n";
  }

  static std::string percent(double x, double y, std::size_t successes, std::size_t runs) {
    const double share = 100 * static_cast<double>(successes) / static_cast<double>(runs);
    return textAt(x, y + 4, "middle", fmt::format("{:.0f}", share),
                  " font-size=\"11\" stroke=\"#fff\" stroke-width=\"2.6\" stroke-opacity=\"0.85\" "
                  "paint-order=\"stroke\"");
  }

  std::string axes(double bottom) const {
    std::string elements;
    const std::size_t step = stepOf(x_.labels, cell_.width);
    for (std::size_t x = 0; x < x_.size(); x += step) {
      elements += textAt(left_ + cell_.width * (static_cast<double>(x) + 0.5), bottom + 13,
                         "middle", x_.labels[x]);
    }
    for (std::size_t y = 0; y < y_.size(); ++y) {
      elements += textAt(left_ - 5, topOf(y) + cell_.height / 2 + 4, "end", y_.labels[y]);
    }
    const double middle = left_ + cell_.width * static_cast<double>(x_.size()) / 2;
    elements += textAt(middle, bottom + 13 + kLine_px, "middle", x_.title,
                       fmt::format(" fill=\"{}\"", kFaint));
    const double height = top() + cell_.height * static_cast<double>(y_.size()) / 2;
    elements += textAt(0, 0, "middle", y_.title,
                       fmt::format(" fill=\"{}\" transform=\"translate(12 {:.1f}) rotate(-90)\"",
                                   kFaint, height));
    return elements;
  }

  const SweepTable& table_;
  const SweepScale &x_, &y_;
  std::vector<Counts> counts_;  // by y, then x
  Size cell_{};
  double left_ = 0;
};

/// Of Okabe and Ito, without those that are too light for a line.
constexpr std::array<const char*, 6> kLines = {"#0072B2", "#D55E00", "#009E73",
                                               "#CC79A7", "#E69F00", "#000000"};

}  // namespace

std::string Drawing::svg(const std::string& alternative) const {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" font-family=\"system-ui, 'DejaVu Sans', sans-serif\" font-size=\"12\" "
      "role=\"img\" aria-label=\"{2}\">\n{3}</svg>\n",
      width, height, html::escaped(alternative), elements);
}

Drawing joined(const std::vector<Drawing>& drawings, double width) {
  constexpr double kGap = 18;
  Drawing all;
  double x = 0, y = 0, height = 0;
  for (const Drawing& one : drawings) {
    if (x > 0 && x + one.width > width) {
      x = 0;
      y += height + kGap;
      height = 0;
    }
    all.elements += fmt::format("<g transform=\"translate({:.0f} {:.0f})\">\n{}</g>\n", x, y,
                                one.elements);
    all.width = std::max(all.width, x + one.width);
    x += one.width + kGap;
    height = std::max(height, one.height);
    all.height = std::max(all.height, y + height);
  }
  all.elements = fmt::format("<rect width=\"{:.0f}\" height=\"{:.0f}\" fill=\"#fff\"/>\n", all.width,
                             all.height) +
                 all.elements;
  return all;
}

OutcomeColour colourOf(const std::string& outcome) {
  if (outcome == "converged") return {"#8fd0f5", "#000"};
  if (outcome == "timeout") return {"#F0E442", "#000"};
  if (outcome == "stalled") return {"#E69F00", "#000"};
  if (outcome == "left-image") return {"#D55E00", "#fff"};
  if (outcome == "lost") return {"#CC79A7", "#000"};
  if (outcome == "diverged") return {"#000000", "#fff"};
  if (outcome == "collision") return {"#00597f", "#fff"};
  return {"#c8c8c8", "#000"};
}

std::vector<Drawing> mapsOf(const SweepTable& table, const SweepMap& map) {
  const SweepScale x = table.scale(map.x), y = table.scale(map.y);
  const SweepScale by = map.by.empty() ? SweepScale() : table.scale(map.by);
  std::vector<MapDrawing> facets(std::max<std::size_t>(1, by.size()), MapDrawing(table, x, y));
  for (MapDrawing& facet : facets) {
    facet.xName = map.x;
    facet.yName = map.y;
  }
  for (std::size_t i = 0; i < table.results().size(); ++i) {
    const std::size_t facet =
        map.by.empty() ? 0 : by.places.at(table.cell(i, table.column(map.by)));
    facets[facet].add(i);
  }
  std::vector<Drawing> drawings;
  for (std::size_t i = 0; i < facets.size(); ++i) {
    drawings.push_back(
        facets[i].drawn(map.by.empty() ? "" : fmt::format("{} {}", by.title, by.labels[i])));
  }
  return drawings;
}

Drawing outcomeKey(const SweepTable& table) {
  Drawing key;
  key.height = kLine_px + 6;
  for (const auto& [outcome, count] : table.outcomes()) {
    key.elements += box(key.width, 4, 12, 12, colourOf(outcome).fill);
    key.elements += textAt(key.width + 17, 14, "start", outcome);
    key.width += 17 + widthOf(outcome) + 18;
  }
  return key;
}

namespace {

/// Curves of shares in one pair of axes.
class CurveDrawing {
 public:
  CurveDrawing(const SweepScale& x, std::size_t curves) : x_(x), curves_(curves) {}

  /// Middle of a place, moved aside so that the curves' intervals do not hide each other.
  double xOf(std::size_t place, std::size_t curve) const {
    const double aside = curves_ > 1 ? (static_cast<double>(curve) / static_cast<double>(curves_ - 1) - 0.5) * 10 : 0;
    return kLeft + 12 + share(place) * (kWidth - 24) + aside;
  }
  static double yOf(double share) { return kTop + kHeight * (1 - share); }

  std::string axes() const {
    std::string elements;
    for (const double tick : {0., 0.25, 0.5, 0.75, 1.}) {
      elements += lineFrom(kLeft, yOf(tick), kLeft + kWidth, yOf(tick), "#dcdcdc");
      elements += textAt(kLeft - 6, yOf(tick) + 4, "end", fmt::format("{:.0f} %", 100 * tick));
    }
    double free = 0;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const double x = kLeft + 12 + share(i) * (kWidth - 24), half = widthOf(x_.labels[i]) / 2 + 3;
      elements += lineFrom(x, yOf(0), x, yOf(0) + 4, kFaint);
      if (x - half < free) continue;
      free = x + half;
      elements += textAt(x, yOf(0) + kLine_px, "middle", x_.labels[i]);
    }
    return elements + textAt(kLeft + kWidth / 2, yOf(0) + 2 * kLine_px + 2, "middle", x_.title,
                             fmt::format(" fill=\"{}\"", kFaint));
  }

  std::string curve(std::size_t index, const std::vector<Successes>& byPlace) const {
    const std::string colour = kLines[index % kLines.size()];
    std::string elements, points;
    for (std::size_t i = 0; i < byPlace.size(); ++i) {
      if (byPlace[i].runs == 0) continue;
      const double x = xOf(i, index), y = yOf(byPlace[i].share());
      const auto [low, high] = byPlace[i].interval();
      elements += lineFrom(x, yOf(low), x, yOf(high), colour, 1.2);
      elements += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"><title>{} of {}</title>"
          "</circle>\n",
          x, y, colour, byPlace[i].successes, byPlace[i].runs);
      points += fmt::format("{:.1f},{:.1f} ", x, y);
    }
    if (x_.isOfNumbers()) {
      elements += fmt::format(
          "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"/>\n", points,
          colour);
    }
    return elements;
  }

  static Drawing frame() {
    Drawing drawing;
    drawing.width = kLeft + kWidth + 10;
    drawing.height = kTop + kHeight + 2 * kLine_px + 10;
    return drawing;
  }

  static constexpr double kLeft = 48, kTop = 10, kWidth = 420, kHeight = 220;

 private:
  /// Where a place is between the first, 0, and the last, 1.
  double share(std::size_t place) const {
    if (x_.size() < 2) return 0.5;
    if (!x_.isOfNumbers()) return static_cast<double>(place) / static_cast<double>(x_.size() - 1);
    const auto measure = [&](double x) { return x_.isLog ? std::log(x) : x; };
    const double low = measure(x_.numbers.front()), high = measure(x_.numbers.back());
    return (measure(x_.numbers[place]) - low) / (high - low);
  }

  const SweepScale& x_;
  std::size_t curves_;
};

}  // namespace

Drawing curvesOf(const SweepTable& table, const SweepCurve& curve) {
  const SweepScale x = table.scale(curve.x);
  const SweepScale by = curve.by.empty() ? SweepScale() : table.scale(curve.by);
  const std::size_t count = std::max<std::size_t>(1, by.size());
  std::vector<std::vector<Successes>> all(count, std::vector<Successes>(x.size()));
  for (std::size_t i = 0; i < table.results().size(); ++i) {
    const std::size_t which =
        curve.by.empty() ? 0 : by.places.at(table.cell(i, table.column(curve.by)));
    Successes& here = all[which][x.places.at(table.cell(i, table.column(curve.x)))];
    ++here.runs;
    here.successes += table.isSuccess(table.results()[i].outcome) ? 1 : 0;
  }
  const CurveDrawing axes(x, count);
  Drawing drawing = CurveDrawing::frame();
  drawing.elements = axes.axes();
  for (std::size_t i = 0; i < count; ++i) drawing.elements += axes.curve(i, all[i]);
  double left = CurveDrawing::kLeft;
  for (std::size_t i = 0; i < by.size(); ++i) {
    const double width = widthOf(by.labels[i]) + 40;
    if (left + width > drawing.width) {
      left = CurveDrawing::kLeft;
      drawing.height += kLine_px;
    }
    const double y = drawing.height + 6;
    drawing.elements += lineFrom(left, y - 4, left + 16, y - 4, kLines[i % kLines.size()], 2.5);
    drawing.elements += textAt(left + 21, y, "start", by.labels[i]);
    left += width;
  }
  if (by.size() > 0) drawing.height += kLine_px;
  return drawing;
}

}  // namespace depthservo
