// What facts about a computer mean for whoever wants to run a machine with it.
#include <gtest/gtest.h>

#include <functional>

#include "app/bringup/doctor_command.h"
#include "tests/support/says.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
ComputerFacts good() {
  ComputerFacts facts;
  facts.fifo_granted = facts.memory_lock_granted = facts.realtime_kernel = true;
  facts.governor = "performance";
  facts.can_in_kernel = facts.hidraw_in_kernel = facts.usb_files = true;
  facts.can_interfaces = {"can0", "can1"};
  facts.hidraw = {{"/dev/hidraw0", true}};
  return facts;
}
std::string text_of(const ComputerFacts& facts, Finding::Level level) {
  std::string lines;
  for (const Finding& one : judge_computer(facts)) {
    if (one.level == level) lines += one.about + ": " + one.text + "\n";
  }
  return lines;
}

TEST(DoctorComputer, ComputerWithEverythingIsWell) {
  EXPECT_TRUE(healthy(judge_computer(good())));
  EXPECT_EQ(text_of(good(), Finding::Level::kNote), "");
  EXPECT_TRUE(says(text_of(good(), Finding::Level::kOk), "can0, can1; next: knuckle doctor --can can0"));
}

TEST(DoctorComputer, EachThingMissingIsToldWithItsRemedy) {
  const auto fault = [](const std::function<void(ComputerFacts&)>& change) {
    ComputerFacts facts = good();
    change(facts);
    return text_of(facts, Finding::Level::kFault);
  };
  EXPECT_TRUE(says(fault([](auto& f) { f.fifo_granted = false; }), "rtprio"));
  EXPECT_TRUE(says(fault([](auto& f) { f.memory_lock_granted = false; }), "memlock"));
  EXPECT_TRUE(says(fault([](auto& f) {
                     f.can_in_kernel = false;
                     f.can_error = 97;
                   }),
                   "this kernel has no CAN sockets: Address family not supported"));
  EXPECT_TRUE(says(fault([](auto& f) { f.can_interfaces.clear(); }), "no CAN interface"));
  EXPECT_TRUE(says(fault([](auto& f) { f.hidraw_in_kernel = false; }), "hidraw"));
  EXPECT_TRUE(says(fault([](auto& f) { f.usb_files = false; }), "/dev/bus/usb"));
}

TEST(DoctorComputer, WhatOnlyCostsEvennessIsANote) {
  ComputerFacts facts = good();
  facts.realtime_kernel = false;
  facts.governor = "powersave";
  facts.hidraw[0].usable = false;
  EXPECT_TRUE(healthy(judge_computer(facts)));
  const std::string notes = text_of(facts, Finding::Level::kNote);
  for (const char* part : {"PREEMPT_RT", "powersave", "udev rule"}) EXPECT_TRUE(says(notes, part));
}

TEST(DoctorComputer, FactsAreThoseOfThisComputerWhateverItIs) {
  const ComputerFacts facts = computer_facts();
  EXPECT_EQ(facts.can_in_kernel, facts.can_error == 0);
  EXPECT_TRUE(facts.can_in_kernel || facts.can_interfaces.empty());
}

}  // namespace
}  // namespace knuckle::bringup
