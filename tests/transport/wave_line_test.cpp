#include "transport/wave_line.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <random>

namespace knuckle {
namespace {

constexpr double kStep_s = 1e-3;

/// A sender with random waves, a link that delays, loses and reorders, and the receiver at its end.
struct Line {
  explicit Line(std::uint64_t seed) : random(seed) {}
  std::mt19937_64 random;
  Wave sent;
  WaveReceiver receiver;
  Time now{};
  Duration delay = 40ms, jitter{};
  double loss = 0;
  struct Flying {
    Time due, sent_at;
    Wave wave;
  };
  std::deque<Flying> flying;
  PlanarVector wave = PlanarVector::Zero(), received = PlanarVector::Zero();

  double share() { return std::uniform_real_distribution(0.0, 1.0)(random); }
  void step(const PlanarVector& in) {
    now += 1ms;
    wave = in;
    sent.add(wave, kStep_s);
    if (now.time_since_epoch() % 2ms == 0ns && share() >= loss)
      flying.push_back({now + delay + from_seconds(share() * to_seconds(jitter)), now, sent});
    for (auto it = flying.begin(); it != flying.end();) {
      if (it->due <= now) {
        receiver.take(it->sent_at, it->wave, now);
        it = flying.erase(it);
      } else {
        ++it;
      }
    }
    received = receiver.step(now, kStep_s);
  }
  PlanarVector some(double t) { return PlanarVector(std::sin(9 * t) + share() - 0.5, std::cos(4 * t) + share() - 0.5); }
};

TEST(WaveLine, NeverPlaysMoreEnergyThanWasPutIn) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Line line(seed);
    line.jitter = seed % 2 == 0 ? 15ms : 0ms;
    line.loss = seed % 3 == 0 ? 0.4 : 0;
    double out_J = 0;
    for (int i = 0; i < 5000; ++i) {
      line.step(line.some(i * kStep_s));
      out_J += 0.5 * kStep_s * line.received.squaredNorm();
      ASSERT_LE(out_J, line.sent.energy_J * (1 + 1e-9)) << "seed " << seed << " step " << i;
    }
    EXPECT_GT(out_J, 0.1 * line.sent.energy_J) << "seed " << seed;
  }
}

TEST(WaveLine, DeliversTheWholeIntegralOverAConstantDelayAndAfterLoss) {
  for (const double loss : {0.0, 0.3}) {
    Line line(7);
    line.loss = loss;
    PlanarVector played = PlanarVector::Zero();
    PlanarVector start = PlanarVector::Zero();
    for (int i = 0; i < 3000; ++i) {
      const double t = i * kStep_s;
      line.step(t < 2 ? PlanarVector(1 + std::sin(3 * t), -1) : PlanarVector::Zero());
      if (i == 41) start = line.sent.integral;  // the first message's wave is where it begins
      played += kStep_s * line.received;
    }
    EXPECT_NEAR((played - line.sent.integral).norm(), 0, 0.02) << loss;
    EXPECT_GT(start.norm(), 0);
  }
}

TEST(WaveLine, PlaysNothingOfWhatCameBeforeItWasSkipped) {
  Line line(3);
  for (int i = 0; i < 500; ++i) line.step(PlanarVector(1, 0));
  line.receiver.skip();
  line.flying.clear();
  for (int i = 0; i < 500; ++i) {
    line.step(PlanarVector::Zero());
    ASSERT_EQ(line.received.norm(), 0);
  }
}

TEST(WaveLine, PaysOnlyOutOfWhatIsLeft) {
  Line line(3);
  for (int i = 0; i < 1000; ++i) line.step(line.some(i * kStep_s));
  const double left_J = line.receiver.received_J() - line.receiver.spent_J();
  ASSERT_GT(left_J, 0);
  EXPECT_FALSE(line.receiver.pay(left_J * 1.01));
  EXPECT_TRUE(line.receiver.pay(left_J * 0.99));
  EXPECT_FALSE(line.receiver.pay(left_J * 0.1));
}

}  // namespace
}  // namespace knuckle
