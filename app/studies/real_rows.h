// Figures measured on real recordings, as `scripts/real-recordings` writes them: one row a quantity, beside what
// simpler methods reach on the same held-out data.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace knuckle::studies {

struct RealRow {
  std::string dataset, quantity;
  double value = 0;
  std::string unit;
  std::vector<std::pair<std::string, double>> baselines;  ///< Name of the simpler method, its value.
};

}  // namespace knuckle::studies
