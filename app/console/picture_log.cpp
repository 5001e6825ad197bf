#include "app/console/picture_log.h"

#include <utility>

namespace knuckle::console {

PictureLog::PictureLog(double per_s) : period_(per_s > 0 ? from_seconds(1 / per_s) : Duration::zero()) {
  if (per_s > 0) video::JpegEncoder{};  // whether there can be pictures is said at the start
}

void PictureLog::show(std::uint32_t run, const recording::CameraStamp& stamp, const video::Frame& frame) {
  if (period_ == Duration::zero()) return;
  auto& camera = cameras_[stamp.camera];
  if (!camera) camera = std::make_unique<Camera>();
  const bool due = camera->last == kNever || frame.received - camera->last >= period_;
  const bool paused = camera->last != kNever && stamp.at == camera->next.picture.at;  // time stands still
  if (!due || paused || !camera->encoder.free()) return;
  camera->last = frame.received;
  camera->next = {run, {stamp.at, stamp.camera, {}}};
  camera->encoder.give(frame);
}

std::vector<PictureLog::Made> PictureLog::made() {
  std::vector<Made> all;
  for (auto& [name, camera] : cameras_) {
    camera->next.picture.jpeg = camera->encoder.take();
    if (!camera->next.picture.jpeg.empty()) all.push_back(camera->next);
  }
  return all;
}

std::vector<std::string> PictureLog::problems() {
  std::vector<std::string> all;
  for (auto& [name, camera] : cameras_) {
    const std::string problem = camera->encoder.problem();
    if (!problem.empty()) all.push_back("camera " + name + ": no picture is recorded any more: " + problem);
  }
  return all;
}

}  // namespace knuckle::console
