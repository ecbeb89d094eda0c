#include <nlohmann/json.hpp>

#include "depthservo/servo/Reproduce.h"

namespace depthservo {

const std::vector<Paper>& papers() {
  static const std::vector<Paper> all = {
      {"deluca2008",
       "A. De Luca, G. Oriolo, P. Robuffo Giordano: Feature depth observation for image-based "
       "visual servoing: theory and experiments. International Journal of Robotics Research "
       "27(10), 2008",
       reproduceDeLuca2008},
      {"durand2010",
       "A. Durand Petiteville, M. Courdesses, V. Cadenat: A new predictor/corrector pair to "
       "estimate "
       "the visual features depth during a vision-based navigation task in an unknown environment. "
       "ICINCO 2010",
       reproduceDurand2010},
      {"ibuki2023",
       "T. Ibuki, H. Nakano, S. Shigaki, T. Hatanaka: Sampled visual feedback pose estimation and "
       "regulation based on camera frame rates. Advanced Robotics 37, 2023",
       reproduceIbuki2023}};
  return all;
}

std::string toJson(const std::vector<ReproduceRow>& rows) {
  auto json = nlohmann::ordered_json::array();
  for (const ReproduceRow& row : rows) {
    json.push_back({{"id", row.id},
                    {"claim", row.claim},
                    {"paper", row.paper},
                    {"expected", row.expected},
                    {"ours", row.ours},
                    {"unit", row.unit},
                    {"pass", row.pass},
                    {"reproduces", row.reproduces},
                    {"note", row.note}});
  }
  return json.dump(2);
}

}  // namespace depthservo
