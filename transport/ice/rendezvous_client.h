// An end's connection to the rendezvous: dialled, watched and dialled again by itself, in the thread of a GLib loop.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/descriptor.h"
#include "transport/ice/glib_source.h"
#include "transport/ice/rendezvous_line.h"

namespace knuckle::ice {

class RendezvousClient {
 public:
  using Clock = std::chrono::steady_clock;

  class Listener {
   public:
    virtual ~Listener() = default;
    /// Somebody else is in the room, since now or before.
    virtual void somebody_in(const std::string& room) = 0;
    virtual void message(const std::string& room, const Bytes& bytes) = 0;
  };

  /// @param address "HOST:PORT", looked up at each dialling.
  RendezvousClient(GMainContext* context, std::string address, Listener& listener);
  ~RendezvousClient();
  RendezvousClient(const RendezvousClient&) = delete;
  RendezvousClient& operator=(const RendezvousClient&) = delete;

  /// Where it is from now on, by a new connection: there is no leaving a room otherwise. Without any it does not dial.
  void set_rooms(std::vector<std::string> rooms);
  /// Lost where there is no connection.
  void send(const std::string& room, const Bytes& bytes);
  /// The network may have changed: unless the rendezvous answers at once, the connection is made anew.
  void doubt(Clock::time_point now);
  /// Often.
  void tend(Clock::time_point now);
  /// What is wrong, in one line; empty: nothing.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

 private:
  struct Dialling;
  void dial();
  void connected(Descriptor socket);
  void failed(const std::string& why);
  void hang_up();
  void read();
  void obey(std::string_view line);
  void write(std::string_view line);
  void flush();

  GMainContext* context_;
  const std::string address_;
  std::vector<std::string> rooms_;
  Listener& listener_;
  std::shared_ptr<Dialling> dialling_;  // under way
  Descriptor socket_;
  GlibSource readable_;
  LineBuffer in_;
  std::string out_, problem_;
  Clock::time_point dial_at_{}, pinged_at_{}, window_at_{};
  std::optional<Clock::time_point> answer_by_;  // else the connection is dead
  std::chrono::milliseconds back_off_;
  int lines_ = 0;  // in this window
};

}  // namespace knuckle::ice
