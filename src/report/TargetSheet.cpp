#include "depthservo/report/TargetSheet.h"

#include <cairo-pdf.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

#include "depthservo/text/NewFolder.h"

namespace depthservo {
namespace {

constexpr double kPerMetre = 72 / 0.0254;  // PDF points
constexpr double kEdge = 0.008;            // that printers leave white [m]
constexpr double kFoot = 0.032;            // for the text and the ruler [m]

/// Half the width and height that is covered [m].
Eigen::Vector2d halfSizeOf(const SequenceTarget& seen) {
  if (seen.tags) {
    const AprilTagTarget::Tag& tag = seen.tags->tags.front();
    const GrayPatch bitmap = aprilTagBitmap(seen.tags->family, tag.id, tag.size.value());
    return {bitmap.width / 2, bitmap.height / 2};
  }
  if (seen.board) {
    const Eigen::Vector2d squares(seen.board->columns + 1, seen.board->rows + 1);
    return 0.5 * seen.board->square.value() * squares;
  }
  Eigen::Vector2d most(0, 0);
  for (const Eigen::Vector3d& p : seen.target.points) most = most.cwiseMax(p.head<2>().cwiseAbs());
  return most.array() + seen.target.radius;
}

std::string titleOf(const SequenceTarget& seen) {
  if (seen.tags) {
    const AprilTagTarget::Tag& tag = seen.tags->tags.front();
    return fmt::format("AprilTag {} number {}, {:g} mm from corner to corner", seen.tags->family,
                       tag.id, 1000 * tag.size.value());
  }
  if (const auto& board = seen.board) {
    const std::string corners = fmt::format("{} x {} inner corners, squares of {:g} mm",
                                            board->columns, board->rows, 1000 * *board->square);
    if (!board->markers) return "chessboard, " + corners;
    return fmt::format("ChArUco board, {}, markers {} of {:g} mm", corners,
                       board->markers->dictionary, 1000 * board->markers->size);
  }
  const Eigen::Vector2d half = halfSizeOf(seen).array() - seen.target.radius;
  return fmt::format("{} dots, outer centres {:g} x {:g} mm apart, radius {:g} mm",
                     seen.target.points.size(), 2000 * half.x(), 2000 * half.y(),
                     1000 * seen.target.radius);
}

class Page {
 public:
  explicit Page(const Paper& paper)
      : surface_(cairo_pdf_surface_create_for_stream(append, &pdf_, paper.width * kPerMetre,
                                                     paper.height * kPerMetre),
                 cairo_surface_destroy),
        cairo_(cairo_create(surface_.get()), cairo_destroy) {
    // The day of printing would be another byte every day.
    cairo_pdf_surface_set_metadata(surface_.get(), CAIRO_PDF_METADATA_CREATE_DATE,
                                   "2000-01-01T00:00:00Z");
    cairo_scale(cairo_.get(), kPerMetre, kPerMetre);
  }

  /// The origin of what follows [m from the upper left corner].
  void moveOrigin(double x, double y) { cairo_translate(cairo_.get(), x, y); }

  void disc(double x, double y, double radius) {
    cairo_arc(cairo_.get(), x, y, radius, 0, 2 * M_PI);
    cairo_fill(cairo_.get());
  }

  /// Black cells are joined along rows: no hair between two of them.
  void bitmap(const GrayPatch& patch) {
    const double cell = patch.width / patch.columns;
    const double left = patch.oMp.translation().x() - patch.width / 2;
    const double top = patch.oMp.translation().y() - patch.height / 2;
    for (int row = 0; row < patch.rows; ++row) {
      for (int first = 0; first < patch.columns; ++first) {
        int end = first;
        while (end < patch.columns && isBlack(patch, row, end)) ++end;
        if (end == first) continue;
        cairo_rectangle(cairo_.get(), left + first * cell, top + row * cell, (end - first) * cell,
                        cell);
        first = end;
      }
    }
    cairo_set_antialias(cairo_.get(), CAIRO_ANTIALIAS_NONE);
    cairo_fill(cairo_.get());
  }

  /// Ticks every 10 mm; its ends are the ends of its length.
  void ruler(double x, double y, double length) {
    constexpr double kThick = 0.0002, kTick = 0.0025, kStep = 0.01;
    cairo_rectangle(cairo_.get(), x, y, length, kThick);
    const int ticks = static_cast<int>(std::lround(length / kStep));
    for (int i = 0; i <= ticks; ++i) {
      const double at = std::clamp(x + i * kStep - kThick / 2, x, x + length - kThick);
      cairo_rectangle(cairo_.get(), at, y - kTick, kThick, kTick);
    }
    cairo_fill(cairo_.get());
  }

  /// Centred. \param height of the letters [m]
  void text(double x, double y, double height, const std::string& words) {
    cairo_select_font_face(cairo_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo_.get(), height);
    cairo_text_extents_t extents;
    cairo_text_extents(cairo_.get(), words.c_str(), &extents);
    cairo_move_to(cairo_.get(), x - extents.width / 2, y);
    cairo_show_text(cairo_.get(), words.c_str());
  }

  /// The PDF. (Left to write a file, cairo does not say when its end is missing.)
  std::string finish() {
    cairo_show_page(cairo_.get());
    cairo_surface_finish(surface_.get());
    for (const auto status : {cairo_status(cairo_.get()), cairo_surface_status(surface_.get())}) {
      if (status != CAIRO_STATUS_SUCCESS) throw std::runtime_error(cairo_status_to_string(status));
    }
    return std::move(pdf_);
  }

 private:
  static cairo_status_t append(void* pdf, const unsigned char* bytes, unsigned count) {
    static_cast<std::string*>(pdf)->append(reinterpret_cast<const char*>(bytes), count);
    return CAIRO_STATUS_SUCCESS;
  }
  static bool isBlack(const GrayPatch& patch, int row, int column) {
    return patch.gray[static_cast<std::size_t>(row * patch.columns + column)] < 128;
  }

  std::string pdf_;
  std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface_;
  std::unique_ptr<cairo_t, void (*)(cairo_t*)> cairo_;
};

void requireFit(const SequenceTarget& seen, const Paper& paper) {
  const Eigen::Vector2d half = halfSizeOf(seen);
  const Eigen::Vector2d room(paper.width - 2 * kEdge, paper.height - 2 * kEdge - kFoot);
  const double scale = (room.array() / (2 * half.array())).minCoeff();
  if (scale >= 1) return;
  throw InputError({seen.board ? "--square" : "--size", 0, ""},
                   fmt::format("the target is {:.0f} x {:.0f} mm, the paper has room for {:.0f} x "
                               "{:.0f} mm; make it at most {:.3g} times as large",
                               2000 * half.x(), 2000 * half.y(), 1000 * room.x(), 1000 * room.y(),
                               std::floor(scale * 1000) / 1000));
}

std::string pdfOf(const SequenceTarget& seen, const Paper& paper) {
  Page page(paper);
  page.moveOrigin(paper.width / 2, (paper.height - kFoot) / 2);
  if (seen.tags) {
    const AprilTagTarget::Tag& tag = seen.tags->tags.front();
    page.bitmap(aprilTagBitmap(seen.tags->family, tag.id, tag.size.value()));
  } else if (seen.board) {
    for (const GrayPatch& patch : seen.board->patches(0, 255)) page.bitmap(patch);
  } else {
    for (const Eigen::Vector3d& p : seen.target.points) page.disc(p.x(), p.y(), seen.target.radius);
  }
  const double foot = (paper.height + kFoot) / 2 - kFoot;  // from the origin
  constexpr double kRuler = 0.1, kLetters = 0.0032;
  page.text(0, foot + 0.006, kLetters, titleOf(seen) + "; this edge is the lower one");
  page.ruler(-kRuler / 2, foot + 0.015, kRuler);
  page.text(0, foot + 0.021, kLetters,
            "print at 100 % (no fit to page): the ruler must measure 100 mm");
  return page.finish();
}

}  // namespace

Paper Paper::named(const std::string& name) {
  if (name == "a4") return {0.210, 0.297};
  if (name == "letter") return {8.5 * 0.0254, 11 * 0.0254};
  throw InputError({"--paper", 0, ""},
                   fmt::format("'{}' is not known; expected a4 or letter", name));
}

DotTarget dotGrid(int columns, int rows, double width, double radius) {
  const double step = width / std::max(1, columns - 1);
  DotTarget target;
  target.radius = radius;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      target.points.emplace_back((i - (columns - 1) / 2.0) * step, (j - (rows - 1) / 2.0) * step,
                                 0);
    }
  }
  if (columns == 2 && rows == 2) std::swap(target.points[2], target.points[3]);
  return target;
}

void writeTargetSheet(const SequenceTarget& seen, const Paper& paper, const std::string& file) {
  requireNewFile(file);
  requireFit(seen, paper);
  makeFile(file, pdfOf(seen, paper));
}

std::string targetYaml(const SequenceTarget& seen) {
  if (seen.tags) {
    std::string text =
        fmt::format("target:\n  type: apriltag\n  family: {}\n  tags:\n", seen.tags->family);
    for (const AprilTagTarget::Tag& tag : seen.tags->tags) {
      text += fmt::format("    - {{id: {}, size: {}}}\n", tag.id, tag.size.value());
    }
    return text;
  }
  if (const auto& board = seen.board) {
    std::string text = fmt::format("target:\n  type: {}\n  columns: {}\n  rows: {}\n  square: {}\n",
                                   board->markers ? "charuco" : "chessboard", board->columns,
                                   board->rows, *board->square);
    if (!board->markers) return text;
    return text + fmt::format("  marker: {}\n  dictionary: {}\n", board->markers->size,
                              board->markers->dictionary);
  }
  std::string points;
  const auto rounded = [](double metres) { return std::round(metres * 1e9) / 1e9 + 0.0; };
  for (const Eigen::Vector3d& p : seen.target.points) {
    points +=
        fmt::format("{}[{}, {}, 0]", points.empty() ? "" : ", ", rounded(p.x()), rounded(p.y()));
  }
  return fmt::format("target:\n  type: dots\n  points: [{}]\n  radius: {}\n", points,
                     seen.target.radius);
}

}  // namespace depthservo
