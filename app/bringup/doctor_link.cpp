#include "app/bringup/doctor_command.h"
#include "app/pairing/key_folder.h"
#include "core/error.h"
#include "transport/secure/handshake_trial.h"

namespace knuckle::bringup {
namespace {

using Level = Finding::Level;

std::string why_not(const secure::Trial& trial) {
  if (trial.port_closed)
    return "the computer answers, but no program listens on this port: start knuckle slave there, or check the port";
  if (trial.refusal == secure::Refusal::kSilence && trial.not_dtls)
    return "something answers there, but not in DTLS: another program, or knuckle slave with --insecure";
  std::string text = secure::text(trial.refusal);
  if (trial.peer) text += " (it calls itself " + trial.peer_name + ", " + secure::short_text(*trial.peer) + ")";
  return text;
}

Finding judge(const std::string& about, const secure::Trial& trial, const secure::Peers& peers) {
  if (trial.refusal != secure::Refusal::kNone) return {Level::kFault, about, why_not(trial)};
  std::string name = trial.peer_name;
  for (const secure::Peer& peer : peers) {
    if (peer.fingerprint == trial.peer) name = peer.name;
  }
  const std::string who = "handshake succeeded with " + name + " (" + secure::short_text(*trial.peer) + ")";
  if (!trial.busy) return {Level::kOk, about, who + "; nobody has control there"};
  return {Level::kNote, about,
          who + "; " + (trial.holder.empty() ? "somebody" : trial.holder) +
              " has control there now: who connects asks for it"};
}

void add_warning(Findings& found, const std::string& whose, const std::string& expires_utc) {
  if (const std::string warning = pairing::expiry_warning(whose, expires_utc); !warning.empty())
    found.push_back({Level::kNote, "expiry", warning});
}

}  // namespace

Findings try_addresses(const std::vector<SocketAddress>& addresses, const secure::Identity& identity,
                       const secure::Peers& peers, std::chrono::milliseconds patience,
                       const std::function<bool()>& keep_on) {
  Findings found;
  bool succeeded = false;
  for (const SocketAddress& address : addresses) {
    const std::string about = "link " + text(address);
    try {
      const secure::Trial trial = secure::try_handshake(address, identity, peers, patience, keep_on);
      found.push_back(judge(about, trial, peers));
      succeeded |= trial.refusal == secure::Refusal::kNone;
    } catch (const InputError& error) {  // such as no route to it
      found.push_back({Level::kFault, about, error.what()});
    }
  }
  for (Finding& one : found) {
    if (succeeded && one.level == Level::kFault) one.level = Level::kNote;
  }
  return found;
}

Findings doctor_link(const LinkDoctorOptions& options, const std::function<bool()>& keep_on) {
  Findings found;
  try {
    const pairing::KeyFolder folder(options.keys);
    const secure::Identity identity = folder.identity();
    const secure::Peers peers = folder.peers();
    found.push_back({Level::kOk, "key",
                     identity.name + " (" + secure::short_text(identity.fingerprint()) + "), valid until " +
                         identity.expires_utc()});
    add_warning(found, pairing::kThisComputers, identity.expires_utc());
    if (peers.empty()) {
      found.push_back({Level::kFault, "pairing", "this computer is paired with nobody: knuckle pair"});
      return found;
    }
    for (const secure::Peer& peer : peers) {
      if (!peer.revoked) add_warning(found, peer.name + "'s", peer.expires_utc);
    }
    const Findings tried = try_addresses(look_up(options.address), identity, peers, options.patience, keep_on);
    found.insert(found.end(), tried.begin(), tried.end());
  } catch (const InputError& error) {  // key, peers, name: each says in one line what is wrong
    found.push_back({Level::kFault, "link", error.what()});
  }
  return found;
}

}  // namespace knuckle::bringup
