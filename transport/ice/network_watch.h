// Tells when addresses or links of this computer change (Linux, rtnetlink).
#pragma once

#include <functional>

#include "transport/ice/glib_source.h"
#include "transport/udp_socket.h"

namespace knuckle::ice {

class NetworkWatch {
 public:
  /// Where the system does not tell, nothing is ever called: a path that fails is noticed all the same.
  NetworkWatch(GMainContext* context, std::function<void()> changed);

 private:
  UdpSocket socket_;
  GlibSource readable_;
};

}  // namespace knuckle::ice
