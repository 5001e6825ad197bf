// What the doctor says of a module with analogue inputs and outputs.
#include <gtest/gtest.h>

#include "app/bringup/doctor_bus.h"
#include "tests/bringup/surveyed.h"
#include "tests/support/module_machine.h"

namespace knuckle::bringup {
namespace {

constexpr std::uint8_t kModule = 0x41;

BusDiagnosis module_looked_at(sim::NodeFault fault = sim::NodeFault::kNone) {
  const MachineDescription file = knuckle::test::module_machine();
  const auto bus = std::make_shared<sim::MachineOnBus>(sim::nominal_truth(file), sim::WorldDescription{},
                                                       JointVector(0.3, -1.5, -0.8), 1);
  EXPECT_TRUE(bus->machine().inject(kModule, fault));
  BusAccess access = sim::access_to(bus);
  return diagnose(survey_bus(access, file.bus.bit_rate, doctor_objects(file), test::brief()), &file);
}

TEST(DoctorModule, ReadsItsInputs) {
  const BusDiagnosis diagnosis = module_looked_at();
  EXPECT_TRUE(healthy(diagnosis.findings)) << test::faults(diagnosis);
  const std::string reading = test::line(diagnosis, kModule).reading;
  EXPECT_EQ(reading.rfind("boom_head_pressure ", 0), 0U) << reading;
  EXPECT_NE(reading.find(", boom_angle 0.300 rad, arm_angle -1.5"), std::string::npos) << reading;
}

TEST(DoctorModule, ABrokenWireIsAFault) {
  const std::string faults = test::faults(module_looked_at(sim::NodeFault::kInvalid));
  EXPECT_NE(faults.find("boom_head_pressure: its wire is broken or has a short circuit: outside 4-20mA"),
            std::string::npos)
      << faults;
}

}  // namespace
}  // namespace knuckle::bringup
