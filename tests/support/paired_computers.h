// Keys of two computers that are paired with each other, as `knuckle pair` leaves them.
#pragma once

#include <string>

#include "app/pairing/key_folder.h"

namespace knuckle::test {

/// A computer's key is made where it has none. @param machine_keys, @param operator_keys folders.
inline void pair_computers(const std::string& machine_keys, const std::string& operator_keys, const std::string& name,
                           bool observer = false) {
  const pairing::KeyFolder here(machine_keys), there(operator_keys);
  const auto key_of = [](const pairing::KeyFolder& folder, const std::string& computer) {
    return folder.has_key() ? folder.identity() : folder.make(computer);
  };
  const secure::Identity machine = key_of(here, "site arm"), desk = key_of(there, name);
  here.change_peers([&](secure::Peers& peers) {
    peers.push_back({desk.fingerprint(), name, false, observer, desk.expires_utc()});
  });
  there.change_peers([&](secure::Peers& peers) {
    peers.push_back({machine.fingerprint(), "site arm", false, false, machine.expires_utc()});
  });
}

}  // namespace knuckle::test
