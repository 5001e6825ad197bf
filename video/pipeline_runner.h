// A GStreamer pipeline that is kept running in a thread of its own: begun, watched, and begun again when it fails.
#pragma once

#include <gst/gst.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "core/mailbox.h"
#include "core/time.h"
#include "video/frame.h"

namespace knuckle::video {

/// All functions are called in the runner's thread.
struct PipelinePlan {
  std::string name;                          ///< Who speaks, in messages: "camera mast".
  std::string description;                   ///< As gst-launch-1.0 takes it.
  std::function<std::string()> check;        ///< What to look at where nothing comes: "the camera and the network".
  std::function<void(GstElement*)> prepare;  ///< Before it runs, each time.
  std::function<void(GstElement*)> ready;    ///< It runs; may be empty.
  std::function<void(GstElement*)> tend;     ///< Every 50 ms; may be empty.
  std::function<std::string()> problem{};    ///< Why to begin again now; empty: nothing. As tend; may be empty.
  std::function<std::uint64_t()> refused{};  ///< As CameraStatus has it; may be empty.
  Patience patience{};
};

class PipelineRunner {
 public:
  explicit PipelineRunner(PipelinePlan plan);
  /// Waits until GStreamer has let go of everything.
  ~PipelineRunner();
  PipelineRunner(const PipelineRunner&) = delete;
  PipelineRunner& operator=(const PipelineRunner&) = delete;

  /// Any thread, for each picture that passes: one that stops passing is a failure.
  void count() noexcept { passed_.fetch_add(1, std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t counted() const noexcept { return passed_.load(std::memory_order_relaxed); }
  /// Counts the times that it was begun up from 1; as of now, while it runs.
  [[nodiscard]] std::uint32_t connection() const noexcept { return connection_.load(std::memory_order_relaxed); }
  /// False where it is as before. One thread.
  bool take(CameraStatus& status) noexcept { return statuses_.take(status); }

 private:
  void run();
  /// Until it fails or is to end. @return what failed; nothing where it is to end.
  [[nodiscard]] std::optional<std::string> connect();
  [[nodiscard]] std::optional<std::string> watch(GstElement* pipeline);
  [[nodiscard]] std::optional<std::string> problem_of(GstMessage* message);
  void tell(bool playing, const std::string& why);
  void wait(Duration time);

  const PipelinePlan plan_;
  Mailbox<CameraStatus> statuses_;
  CameraStatus status_;
  std::atomic<bool> ending_{false};
  std::atomic<std::uint64_t> passed_{0};
  std::atomic<std::uint32_t> connection_{0};
  std::string missing_;
  std::thread thread_;
};

}  // namespace knuckle::video
