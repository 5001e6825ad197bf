// A rendezvous that works on by itself, as long as it is there.
#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "app/rendezvous/rendezvous_server.h"

namespace knuckle::test {

class RunningRendezvous {
 public:
  explicit RunningRendezvous(const std::string& address = "127.0.0.1:0") : server_(address) {
    thread_ = std::thread([this] {
      while (!ending_) server_.step(std::chrono::milliseconds(5));
    });
  }
  ~RunningRendezvous() {
    ending_ = true;
    thread_.join();
  }
  [[nodiscard]] std::string address() const { return text(server_.address()); }

 private:
  rendezvous::RendezvousServer server_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace knuckle::test
