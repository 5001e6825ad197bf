#include "app/programs/recorded_can.h"

#include "transport/virtual_can.h"

namespace knuckle::programs {

void RecordedCan::write(std::ostream& out, const std::string& interface) {
  TimedFrame passed;
  while (passed_.pop(passed)) out << candump_line(passed.at, passed.frame, interface.c_str()) << '\n';
}

}  // namespace knuckle::programs
