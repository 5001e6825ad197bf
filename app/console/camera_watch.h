// One camera of the console: its newest picture, how old that is, and what there is to be said of it. No window.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/console/event_book.h"
#include "core/time.h"
#include "recording/camera_picture.h"
#include "video/camera.h"
#include "video/frame.h"
#include "video/newest.h"

namespace knuckle::console {

/// Where a camera's pictures come from; neither function ever waits.
struct CameraFeed {
  std::string name;
  std::function<std::unique_ptr<video::Frame>()> newest;  ///< Once each; nullptr: none newer.
  std::function<video::CameraStatus()> status;
  std::function<void(const video::PictureKey&)> set_key{};  ///< What its pictures are sealed with; may be empty.
};

/// Of what GStreamer connects to. @param source checked before. @param bell rung for each picture; nullptr: none.
[[nodiscard]] CameraFeed feed_of(const video::CameraSource& source, std::shared_ptr<video::Bell> bell = nullptr);

class CameraWatch {
 public:
  explicit CameraWatch(CameraFeed feed) : feed_(std::move(feed)) {}

  struct News {
    Severity severity = Severity::kInfo;
    std::string what;
  };
  /// Takes the newest picture in. @return the picture, where there is a new one; and into news, what is to be logged.
  [[nodiscard]] std::unique_ptr<video::Frame> watch(Time now, std::vector<News>& news);

  /// What the machine's side seals its pictures with from now on.
  void set_key(const video::PictureKey& key) const {
    if (feed_.set_key) feed_.set_key(key);
  }
  [[nodiscard]] const std::string& name() const noexcept { return feed_.name; }
  /// As of the last watch().
  [[nodiscard]] video::VideoState state() const noexcept { return state_; }
  [[nodiscard]] double age_s() const noexcept { return age_s_; }
  /// The age does not contain what the quickest picture took: its sender's clock is not ours.
  [[nodiscard]] bool age_is_relative() const noexcept { return frame_age_.relative(); }
  /// Parts of the picture may be old, or were within the last second: packets were lost.
  [[nodiscard]] bool damaged() const noexcept { return damaged_; }
  /// The last problem of the connection, where there is no live picture; may be empty.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

 private:
  void tell_state(Time now, std::vector<News>& news);
  void tell_problem(const video::CameraStatus& status, std::vector<News>& news);
  void tell_damage(Time now, const video::Frame* frame, std::vector<News>& news);
  void tell_refused(Time now, const video::CameraStatus& status, std::vector<News>& news);

  CameraFeed feed_;
  video::FrameAge frame_age_;
  video::VideoState state_ = video::VideoState::kNone;
  double age_s_ = 0;
  video::VideoState told_state_ = video::VideoState::kNone;
  Time telling_since_ = kNever;
  int told_ = 0;  ///< Changes told since then; after a few no more are.
  Time not_live_since_ = kNever;
  std::uint32_t troubles_ = 0;
  std::uint64_t refused_ = 0;  // as told
  Time refused_told_at_ = kNever;
  bool damaged_ = false;
  Time damaged_at_ = kNever, damage_told_at_ = kNever;
  std::string problem_;
};

/// For the recording, of a frame that watch() has just taken. @param now as given to it. @param at the same moment in
/// the session's time.
[[nodiscard]] recording::CameraStamp stamp_of(const CameraWatch& watch, const video::Frame& frame, Time now, Time at);

}  // namespace knuckle::console
