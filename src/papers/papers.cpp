#include <nlohmann/json.hpp>

#include "depthservo/papers/Reproduce.h"

namespace depthservo {

const std::vector<Paper>& papers() {
  static const std::vector<Paper> all = {
      {"deluca2008",
       "A. De Luca, G. Oriolo, P. Robuffo Giordano: Feature depth observation for image-based "
       "visual servoing: theory and experiments. International Journal of Robotics Research "
       "27(10), 2008",
       reproduceDeLuca2008,
       {{"5.1", "Section 5.1: depth in the numerical example, by how the observer is sampled"},
        {"5.1-arm", "Section 5.1: depth under an arm, with image noise"},
        {"5.2", "Section 5.2: focal length in the numerical example"},
        {"7.1", "Section 7.1: focal length on the unicycle"},
        {"7.2", "Section 7.2: servo on four points from wrong guesses"},
        {"7.3", "Section 7.3: servo on moments from wrong guesses"}}},
      {"durand2010",
       "A. Durand Petiteville, M. Courdesses, V. Cadenat: A new predictor/corrector pair to "
       "estimate the visual features depth during a vision-based navigation task in an unknown "
       "environment. "
       "ICINCO 2010",
       reproduceDurand2010,
       {{"print", "What cannot hold as printed"},
        {"noise-free", "The simulation without noise"},
        {"i", "Simulation (i): perfect data"},
        {"ii", "Simulation (ii): 1 px noise"},
        {"iii", "Simulation (iii): images hidden for 7 s <= t < 9 s"},
        {"long", "Images hidden for 7 s <= t < 20 s"},
        {"images", "The simulations again, with the dots measured in rendered images"},
        {"observer", "The observer of De Luca, Oriolo, Robuffo Giordano 2008 on the same images"}}},
      {"ibuki2023",
       "T. Ibuki, H. Nakano, S. Shigaki, T. Hatanaka: Sampled visual feedback pose estimation and "
       "regulation based on camera frame rates. Advanced Robotics 37, 2023",
       reproduceIbuki2023,
       {{"conditions", "Frame rates that suffice for the gains of the paper"},
        {"limit", "Frame rates below which the linear loop diverges"},
        {"design", "Gains designed for a frame rate"},
        {"A", "Simulation: regulation at 60 Hz and at other frame rates"},
        {"B", "Experiment at 18 Hz, simulated"},
        {"C", "Noise of the estimated pose"},
        {"images", "The same with the dots measured in rendered images"}}}};
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
