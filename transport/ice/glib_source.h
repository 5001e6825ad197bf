// Timers and descriptors of a GLib loop, ended with the object that holds them.
#pragma once

#include <chrono>
#include <functional>

using GMainContext = struct _GMainContext;
using GSource = struct _GSource;

namespace knuckle::ice {

class GlibSource {
 public:
  GlibSource() = default;
  [[nodiscard]] static GlibSource every(GMainContext* context, std::chrono::milliseconds period,
                                        std::function<void()> call);
  /// Once, as soon as the loop has nothing older to do.
  [[nodiscard]] static GlibSource soon(GMainContext* context, std::function<void()> call);
  /// Whenever the descriptor can be read; it outlives the source.
  [[nodiscard]] static GlibSource readable(GMainContext* context, int descriptor, std::function<void()> call);
  GlibSource(GlibSource&& other) noexcept;
  GlibSource& operator=(GlibSource&& other) noexcept;
  ~GlibSource();

 private:
  explicit GlibSource(GSource* source) noexcept : source_(source) {}
  GSource* source_ = nullptr;
};

}  // namespace knuckle::ice
