// A session is a function of its options and seed, bit for bit.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "app/session/session_result.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"

namespace knuckle::test {
namespace {

std::string digest(const std::string& scenario, std::uint64_t seed, double loss = 0) {
  session::SimulateOptions options;
  options.scenario = scenario;
  options.seed = seed;
  options.duration_s = 8;
  options.delay_ms = 10;
  options.jitter_ms = 5;
  options.loss = loss;
  return session::run_simulation(options, {}).digest.whole;
}

std::string digest_of_program(const std::string& scenario, std::uint64_t seed) {
  const ProgramRun run =
      run_program(test::program("knuckle"), {"simulate", "--scenario", scenario, "--seed", std::to_string(seed),
                                             "--duration", "8", "--jitter-ms", "5", "--json", "-"});
  return nlohmann::json::parse(run.out).at("digest");
}

TEST(Digest, IsTheSameForTheSameSeedWithinAProgramAndAcrossRunsOfIt) {
  const std::string first = digest("wall_contact", 7);
  EXPECT_EQ(first.size(), 64u);
  EXPECT_EQ(digest("wall_contact", 7), first);
  EXPECT_EQ(digest_of_program("wall_contact", 7), first);
}

TEST(Digest, DiffersWithSeedScenarioAndLink) {
  const std::set<std::string> digests{digest("wall_contact", 7), digest("wall_contact", 8), digest("free_motion", 7),
                                      digest("wall_contact", 7, 0.05)};
  EXPECT_EQ(digests.size(), 4u);
}

}  // namespace
}  // namespace knuckle::test
