#include "app/console/camera_watch.h"

#include <fmt/format.h>

#include <utility>

namespace knuckle::console {
namespace {

constexpr Duration kSameNews = 30s;
constexpr int kMostChanges = 6;     // of a picture's state that are told in this time
constexpr Duration kReadable = 1s;  // what is written stays for so long

}  // namespace

CameraFeed feed_of(const video::CameraSource& source, std::shared_ptr<video::Bell> bell) {
  std::function<void()> ring;
  if (bell) ring = [bell = std::move(bell)] { bell->ring(); };
  const auto camera = std::make_shared<video::Camera>(source, std::move(ring));
  return {source.name, [camera] { return camera->take(); }, [camera] { return camera->status(); },
          [camera](const video::PictureKey& key) { camera->set_key(key); }};
}

std::unique_ptr<video::Frame> CameraWatch::watch(Time now, std::vector<News>& news) {
  std::unique_ptr<video::Frame> frame = feed_.newest();
  if (frame) frame_age_.take(*frame);
  age_s_ = frame_age_.age_s(now);
  const video::CameraStatus status = feed_.status();
  tell_problem(status, news);
  tell_damage(now, frame.get(), news);
  tell_refused(now, status, news);
  tell_state(now, news);
  return frame;
}

void CameraWatch::tell_state(Time now, std::vector<News>& news) {
  const video::VideoState last = std::exchange(state_, frame_age_.state(now));
  const bool was_fine = last == video::VideoState::kLive || last == video::VideoState::kNone;
  if (last != state_ && was_fine) not_live_since_ = now;
  if (state_ == told_state_) return;
  // A picture that comes and goes must not fill the list of events.
  if (telling_since_ == kNever || now - telling_since_ >= kSameNews) {
    telling_since_ = now;
    told_ = 0;
  }
  if (++told_ > kMostChanges) return;
  const video::VideoState before = std::exchange(told_state_, state_);
  const std::string camera = "camera " + feed_.name + ": ";
  if (state_ == video::VideoState::kLive) {
    news.push_back({Severity::kInfo, before == video::VideoState::kNone
                                         ? camera + "live picture"
                                         : camera + fmt::format("live picture again, after {:.1f} s",
                                                                to_seconds(now - not_live_since_))});
    return;
  }
  const char* what =
      state_ == video::VideoState::kLate ? "video late: the picture shown" : "video frozen: the last picture";
  news.push_back({Severity::kWarning, camera + fmt::format("{} is {:.1f} s old", what, age_s_)});
}

/// A picture looks whole where the decoder has put older ones in the place of what was lost.
void CameraWatch::tell_damage(Time now, const video::Frame* frame, std::vector<News>& news) {
  if (frame != nullptr && frame->damaged) damaged_at_ = now;
  damaged_ = damaged_at_ != kNever && now - damaged_at_ < kReadable;
  if (damaged_at_ != now || (damage_told_at_ != kNever && now - damage_told_at_ < kSameNews)) return;
  damage_told_at_ = now;
  news.push_back({Severity::kWarning, "camera " + feed_.name +
                                          ": packets are lost on the way: parts of the picture are old, until the next "
                                          "key picture"});
}

/// Somebody sends what is not the camera's; or the two computers have another session each.
void CameraWatch::tell_refused(Time now, const video::CameraStatus& status, std::vector<News>& news) {
  if (status.refused == refused_ || (refused_told_at_ != kNever && now - refused_told_at_ < kSameNews)) return;
  const std::uint64_t more = status.refused - std::exchange(refused_, status.refused);
  refused_told_at_ = now;
  news.push_back({Severity::kWarning,
                  "camera " + feed_.name + ": " + std::to_string(more) + (more == 1 ? " packet was" : " packets were") +
                      " refused: not sealed with this session's key for a camera of this name, changed on the way, or "
                      "sent again"});
}

/// A source that keeps failing in the same way is one event.
void CameraWatch::tell_problem(const video::CameraStatus& status, std::vector<News>& news) {
  if (status.troubles == std::exchange(troubles_, status.troubles)) {
    if (status.playing && state_ == video::VideoState::kLive) problem_.clear();
    return;
  }
  const std::string problem = status.why.data();
  if (problem != problem_) news.push_back({Severity::kWarning, problem});
  problem_ = problem;
}

recording::CameraStamp stamp_of(const CameraWatch& watch, const video::Frame& frame, Time now, Time at) {
  const bool senders_clock = frame.stamp_from == video::StampFrom::kSender;
  return {.at = at,
          .camera = watch.name(),
          .number = frame.number,
          .connection = frame.connection,
          .senders_clock = senders_clock,
          .captured = senders_clock ? frame.captured : at - (now - frame.captured),
          .received = at - (now - frame.received),
          .age_s = watch.age_s()};
}

}  // namespace knuckle::console
