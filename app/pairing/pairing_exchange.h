// Two computers show each other their certificates over a network that nobody vouches for. That nobody was between them
// is what people find out, by comparing the code that both show; what they find is told to the other computer.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "transport/secure/dtls_session.h"
#include "transport/socket_address.h"

namespace knuckle::pairing {

struct Shown {
  secure::Fingerprint fingerprint;
  std::string name;  ///< As the far end calls itself.
  std::string code;  ///< The same on both, where nobody is between them.
  std::string expires_utc;
};

/// Whether a code is the one on the other computer, as its user says.
enum class Verdict : std::uint8_t { kNone, kYes, kNo };

class PairingExchange {
 public:
  /// @param addresses the one to listen on (the machine's side), or those of the far end, tried in turn: at least one.
  /// @param identity outlives it. @throws InputError where none of the addresses can be used.
  PairingExchange(secure::Role role, const std::vector<SocketAddress>& addresses, const secure::Identity& identity);
  ~PairingExchange();
  PairingExchange(const PairingExchange&) = delete;
  PairingExchange& operator=(const PairingExchange&) = delete;

  /// Tries until it succeeds: junk, floods and ends that do not answer only delay it.
  /// @param keep_on asked now and then; false ends it.
  /// @param tell why an attempt failed, in one line, once for each reason.
  /// @return nothing where it was ended.
  [[nodiscard]] std::optional<Shown> meet(const std::function<bool()>& keep_on,
                                          const std::function<void(const std::string&)>& tell = {});

  // After it, in the session that was made: authentic as far as the two codes are the same.
  /// What there is to be heard and said, for some 20 ms: to be called again and again.
  void serve();
  /// Told to the far end from now on, until it has heard it.
  void say(Verdict verdict);
  /// Serves until the far end has heard what was said, or 3 s have passed, or it is gone already. @return whether it
  /// has.
  bool part();
  [[nodiscard]] Verdict heard() const noexcept;
  /// Nothing was heard for so long.
  static constexpr std::chrono::seconds kGone{10};
  [[nodiscard]] bool gone() const noexcept;

 private:
  class Meeting;
  std::unique_ptr<Meeting> meeting_;
};

// `knuckle pair`: this computer's key, and whom it is paired with.

[[nodiscard]] cli::Command pair_entry();

}  // namespace knuckle::pairing
