#include "app/console/picture/live_scene.h"

#include <algorithm>

namespace knuckle::console::picture {

void LiveScene::begin(const sim::WorldDescription& world) {
  world_ = world;
  record_.events.clear();
  read_ = 0;
  scene_ = session::scene_of(world_, record_, reach_m_);
}

void LiveScene::watch(const sim::WorldEventRing& events) {
  if (events.count < read_) begin(world_);  // the session was restarted
  if (events.count == read_) return;
  constexpr auto kCapacity = sim::WorldEventRing::kCapacity;
  read_ = std::max(read_, events.count > kCapacity ? events.count - kCapacity : 0);
  const auto changes_the_scene = [](sim::WorldEventKind kind) {
    return kind == sim::WorldEventKind::kPieceBroke || kind == sim::WorldEventKind::kPieceDown ||
           kind == sim::WorldEventKind::kScooped;
  };
  for (; read_ < events.count; ++read_) {
    const sim::WorldEvent& event = events.at(read_);
    if (changes_the_scene(event.kind)) record_.events.push_back({event.t_s, name(event.kind)});
  }
  scene_ = session::scene_of(world_, record_, reach_m_);
}

}  // namespace knuckle::console::picture
