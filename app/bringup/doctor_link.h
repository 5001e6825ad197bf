// Whether the machine's side can be reached and lets this computer in; each failure in one line.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "app/bringup/doctor_finding.h"
#include "transport/secure/identity.h"
#include "transport/socket_address.h"

namespace knuckle::bringup {

struct LinkDoctorOptions {
  std::string address;  ///< Of the machine's side; its name may have several addresses.
  std::string keys;     ///< Folder; empty: the usual one.
  std::chrono::milliseconds patience{4000};
};
/// Takes control from nobody. @param keep_on asked now and then; false ends it.
[[nodiscard]] Findings doctor_link(const LinkDoctorOptions& options, const std::function<bool()>& keep_on);
/// The part of it that tries the addresses of a name. The link takes whichever lets it in: what is wrong with the
/// others is a note then, and a fault only where none does.
[[nodiscard]] Findings try_addresses(const std::vector<SocketAddress>& addresses, const secure::Identity& identity,
                                     const secure::Peers& peers, std::chrono::milliseconds patience,
                                     const std::function<bool()>& keep_on);

}  // namespace knuckle::bringup
