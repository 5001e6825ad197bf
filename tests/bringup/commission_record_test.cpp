// Motion of all joints in closed loop on the simulated machine's bus: its rate on the wire, and how it ends.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <vector>

#include "app/bringup/commission_dialogue.h"
#include "app/bringup/commission_result.h"
#include "app/motion/led_machine.h"
#include "app/recordings/recording_reader.h"
#include "tests/bringup/hardware_bench.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

namespace fs = std::filesystem;
using test::simulated_bus;
using test::solar;

class CommissionRecord : public testing::Test {
 protected:
  CommissionRecord() {
    bus_->bus().set_tap({[](void* self, Time at, const CanFrame& frame) {
                           if (frame.id == canopen::kSyncId) static_cast<CommissionRecord*>(self)->syncs_.push_back(at);
                         },
                         this});
    std::string name = (fs::temp_directory_path() / "knuckle_record_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~CommissionRecord() override { fs::remove_all(folder_); }
  /// SYNC waits for the frame on the wire at most; the first step is a millisecond late.
  void expect_sync_period() const {
    ASSERT_GT(syncs_.size(), 100U);
    for (std::size_t i = 2; i < syncs_.size(); ++i) {
      ASSERT_GT(syncs_[i] - syncs_[i - 1], 4500us) << i << " of " << syncs_.size();
      ASSERT_LT(syncs_[i] - syncs_[i - 1], 5500us) << i << " of " << syncs_.size();
    }
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }

  std::shared_ptr<sim::MachineOnBus> bus_ = simulated_bus();
  BusAccess access_ = sim::access_to(bus_);
  std::vector<Time> syncs_;
  fs::path folder_;
};

TEST_F(CommissionRecord, TheWayOutKeepsTheBusAtItsRate) {
  motion::LedMachine led(solar(), access_, access_.now());
  led.engage();
  const std::size_t before = syncs_.size();
  led.neutral();
  EXPECT_NEAR(static_cast<double>(syncs_.size() - before), 60, 1) << "300 ms at 200 Hz";
  expect_sync_period();
  EXPECT_EQ(bus_->machine().nodes().outputs().spool_demand, JointVector::Zero());
}

TEST_F(CommissionRecord, WhoeverStopsItInMotionLeavesAClosedMachineAndNoFile) {
  bool moved = false;
  const auto stopped = [&] {
    moved = bus_->plant().cylinder_mps.cwiseAbs().maxCoeff() > 0.02;
    return moved;
  };
  EXPECT_THROW((void)record_motions(solar(), access_, {}, folder_, stopped), CommissionEnded);
  EXPECT_TRUE(moved);
  expect_sync_period();
  EXPECT_EQ(bus_->machine().nodes().outputs().spool_demand, JointVector::Zero());
  EXPECT_EQ(files(), 0U);
}

}  // namespace
}  // namespace knuckle::bringup
