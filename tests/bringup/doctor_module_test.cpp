// What the doctor says of a module with analogue inputs and outputs.
#include <gtest/gtest.h>

#include "app/bringup/doctor_bus.h"
#include "tests/bringup/surveyed.h"
#include "tests/support/module_machine.h"
#include "tests/support/says.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
constexpr std::uint8_t kModule = 0x41;

BusDiagnosis module_looked_at(sim::NodeFault fault = sim::NodeFault::kNone) {
  const MachineDescription file = knuckle::test::module_machine();
  const auto bus = test::nominal_bus(file);
  EXPECT_TRUE(bus->machine().inject(kModule, fault));
  return test::look(bus, file);
}

TEST(DoctorModule, ReadsItsInputs) {
  const BusDiagnosis diagnosis = module_looked_at();
  EXPECT_TRUE(healthy(diagnosis.findings)) << test::faults(diagnosis);
  const std::string reading = test::line(diagnosis, kModule).reading;
  EXPECT_EQ(reading.rfind("boom_head_pressure ", 0), 0U) << reading;
  EXPECT_TRUE(says(reading, ", boom_angle 0.300 rad, arm_angle -1.5"));
}

TEST(DoctorModule, ABrokenWireIsAFault) {
  const std::string faults = test::faults(module_looked_at(sim::NodeFault::kInvalid));
  EXPECT_TRUE(says(faults, "boom_head_pressure: its wire is broken or has a short circuit: outside 4-20mA"));
}

}  // namespace
}  // namespace knuckle::bringup
