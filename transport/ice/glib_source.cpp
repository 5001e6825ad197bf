#include "transport/ice/glib_source.h"

#include <glib-unix.h>

#include <utility>

namespace knuckle::ice {
namespace {

struct Call {
  std::function<void()> call;
  bool again;
};

gboolean on_time(gpointer data) {
  const auto* call = static_cast<Call*>(data);
  call->call();
  return call->again ? G_SOURCE_CONTINUE : G_SOURCE_REMOVE;
}
gboolean on_descriptor(gint, GIOCondition, gpointer data) {
  static_cast<Call*>(data)->call();
  return G_SOURCE_CONTINUE;
}
void drop(gpointer data) {
  delete static_cast<Call*>(data);
}

GSource* attach(GSource* source, GSourceFunc function, Call call, GMainContext* context) {
  g_source_set_callback(source, function, new Call(std::move(call)), drop);
  g_source_attach(source, context);
  return source;
}

}  // namespace

GlibSource GlibSource::every(GMainContext* context, std::chrono::milliseconds period, std::function<void()> call) {
  return GlibSource(
      attach(g_timeout_source_new(static_cast<guint>(period.count())), on_time, {std::move(call), true}, context));
}

GlibSource GlibSource::soon(GMainContext* context, std::function<void()> call) {
  GSource* source = g_idle_source_new();
  g_source_set_priority(source, G_PRIORITY_DEFAULT);
  return GlibSource(attach(source, on_time, {std::move(call), false}, context));
}

GlibSource GlibSource::readable(GMainContext* context, int descriptor, std::function<void()> call) {
  return GlibSource(attach(g_unix_fd_source_new(descriptor, static_cast<GIOCondition>(G_IO_IN | G_IO_HUP | G_IO_ERR)),
                           G_SOURCE_FUNC(on_descriptor), {std::move(call), true}, context));
}

GlibSource::GlibSource(GlibSource&& other) noexcept : source_(std::exchange(other.source_, nullptr)) {}

GlibSource& GlibSource::operator=(GlibSource&& other) noexcept {
  std::swap(source_, other.source_);
  return *this;
}

GlibSource::~GlibSource() {
  if (source_ == nullptr) return;
  g_source_destroy(source_);
  g_source_unref(source_);
}

}  // namespace knuckle::ice
