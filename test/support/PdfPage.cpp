#include "support/PdfPage.h"

#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace depthservo::test {
namespace {

constexpr double kPerPoint_mm = 25.4 / 72;

std::string inflated(const std::string& bytes) {
  std::string text(1 << 22, '\0');
  uLongf length = text.size();
  if (uncompress(reinterpret_cast<Bytef*>(text.data()), &length,
                 reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()) != Z_OK) {
    return "";
  }
  text.resize(length);
  return text;
}

/// The graphics state that matters for where a path lies.
class Interpreter {
 public:
  explicit Interpreter(double pageHeight) : pageHeight_(pageHeight) {}

  std::vector<PdfBox> run(const std::string& content) {
    std::istringstream words(content);
    for (std::string word; words >> word;) {
      std::istringstream text(word);
      double number = 0;
      if (text >> number && text.eof()) {
        numbers_.push_back(number);
      } else {
        obey(word);
        numbers_.clear();
      }
    }
    return boxes_;
  }

 private:
  void obey(const std::string& op) {
    const auto at = [&](std::size_t i) { return numbers_.at(numbers_.size() - i); };
    if (op == "q") saved_.push_back(matrix_);
    if (op == "Q") {
      matrix_ = saved_.back();
      saved_.pop_back();
    }
    if (op == "cm") {
      Eigen::Affine2d more;
      more.matrix() << at(6), at(4), at(2), at(5), at(3), at(1), 0, 0, 1;
      matrix_ = matrix_ * more;
    }
    if (op == "m" || op == "l" || op == "c")
      path_.push_back(matrix_ * Eigen::Vector2d(at(2), at(1)));
    if (op == "re") {
      path_.push_back(matrix_ * Eigen::Vector2d(at(4), at(3)));
      path_.push_back(matrix_ * Eigen::Vector2d(at(4) + at(2), at(3) + at(1)));
    }
    if (op == "f" || op == "f*") fill();
    if (op == "n" || op == "S" || op == "W") path_.clear();
  }

  void fill() {
    if (path_.empty()) return;
    Eigen::Vector2d low = path_.front(), high = path_.front();
    for (const Eigen::Vector2d& p : path_) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    boxes_.push_back({low.x() * kPerPoint_mm, (pageHeight_ - high.y()) * kPerPoint_mm,
                      high.x() * kPerPoint_mm, (pageHeight_ - low.y()) * kPerPoint_mm});
    path_.clear();
  }

  double pageHeight_;
  Eigen::Affine2d matrix_ = Eigen::Affine2d::Identity();
  std::vector<Eigen::Affine2d> saved_;
  std::vector<Eigen::Vector2d> path_;
  std::vector<double> numbers_;
  std::vector<PdfBox> boxes_;
};

}  // namespace

PdfPage readPdfPage(const std::string& file) {
  std::ostringstream read;
  read << std::ifstream(file, std::ios::binary).rdbuf();
  const std::string pdf = read.str();
  const std::size_t box = pdf.find("/MediaBox [");
  if (box == std::string::npos) throw std::runtime_error(file + " has no page");
  std::istringstream numbers(pdf.substr(box + 11, 100));
  double left, bottom, right, top;
  numbers >> left >> bottom >> right >> top;
  PdfPage page;
  page.width_mm = (right - left) * kPerPoint_mm;
  page.height_mm = (top - bottom) * kPerPoint_mm;
  // The page's content is the first stream.
  const std::size_t start = pdf.find("stream\n") + 7, end = pdf.find("endstream", start);
  page.shapes = Interpreter(top).run(inflated(pdf.substr(start, end - start)));
  return page;
}

}  // namespace depthservo::test
