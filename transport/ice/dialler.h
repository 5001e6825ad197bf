// Paths of this computer's end of the secure link to far ends that cannot be reached by an address: both sides dial out
// to a rendezvous, ICE finds the way. A thread of its own; the link below it and the loops notice nothing.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/histogram.h"
#include "transport/ice/path.h"

namespace knuckle::ice {

struct DialSetup {
  std::string rendezvous;  ///< "HOST:PORT"
  Servers servers;
  secure::Role role = secure::Role::kOperator;
};

class Dialler {
 public:
  /// @param peers the far ends: of the operator's side one. Those that are revoked or have expired get no path, and the
  /// first 32 of the others do.
  /// @throws InputError where an address is malformed.
  Dialler(const DialSetup& setup, const secure::Identity& identity, const secure::Peers& peers);
  ~Dialler();
  Dialler(const Dialler&) = delete;
  Dialler& operator=(const Dialler&) = delete;

  /// Where the operator's end of the secure link connects to: "127.0.0.1:PORT".
  [[nodiscard]] std::string address() const;
  /// Begins to dial. @param link this computer's end of the secure link, as seen from this computer.
  void start(const SocketAddress& link);

  // Any thread.
  /// Of the operator's side the same one, or none. Paths end or begin at once.
  void set_peers(secure::Peers peers);
  /// What has happened since the last call.
  [[nodiscard]] std::vector<PathEvent> take_events();
  /// What keeps the path from being there, or from being found anew, in one line; empty: nothing.
  [[nodiscard]] std::string problem() const;
  /// Pairs that have been in use, oldest first, at most the first 256.
  [[nodiscard]] std::vector<PathEvent> pairs() const;
  /// Of all questions over the paths in use.
  [[nodiscard]] Histogram round_trips() const;

 private:
  class Thread;
  [[nodiscard]] secure::Peers peers() const;
  const DialSetup setup_;
  const Signer signer_;
  UdpSocket inner_;  // operator's side: of its one path
  std::string inner_address_;
  SocketAddress link_;
  std::atomic<bool> ending_{false}, peers_changed_{false};

  mutable std::mutex mutex_;  // of threads that are not real-time
  secure::Peers peers_;
  std::vector<PathEvent> events_, pairs_;
  std::string problem_;
  Histogram round_trips_;

  std::thread thread_;
};

}  // namespace knuckle::ice
