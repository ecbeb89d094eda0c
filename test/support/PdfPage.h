#pragma once

#include <string>
#include <vector>

namespace depthservo::test {

/// What a filled path covers, from the upper left corner of the page.
struct PdfBox {
  double left_mm, top_mm, right_mm, bottom_mm;
};

struct PdfPage {
  double width_mm = 0, height_mm = 0;
  std::vector<PdfBox> shapes;  ///< filled paths in their order, text left out
};

/// Reads the only page of a PDF whose paths are lines, rectangles and arcs of quarter circles.
PdfPage readPdfPage(const std::string& file);

}  // namespace depthservo::test
