// The numbers of sealed streams: none is used twice with one key.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "tests/video/picture_key.h"
#include "video/sealing.h"

namespace knuckle::video {
namespace {

class SealedStreams : public testing::Test {
 protected:
  void SetUp() override { start_gstreamer(); }
  /// A camera that gives three pictures. @return the streams (SSRC) of what leaves.
  std::set<std::uint32_t> run() {
    std::string told;
    std::string description =
        "videotestsrc num-buffers=3 ! video/x-raw,width=160,height=90,framerate=30/1 ! x264enc tune=zerolatency ! "
        "rtph264pay name=payloader ! ";
    description += kSealer;
    description += " ! fakesink name=end sync=false";
    const Owned<GstElement> pipeline = make_pipeline(description, told);
    EXPECT_TRUE(pipeline) << told;
    sealer_.begin(pipeline.get());
    std::set<std::uint32_t> streams;
    const Owned<GstElement> end(gst_bin_get_by_name(GST_BIN(pipeline.get()), "end"));
    const Owned<GstPad> pad(gst_element_get_static_pad(end.get(), "sink"));
    constexpr int kPackets = GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_BUFFER_LIST;
    gst_pad_add_probe(pad.get(), static_cast<GstPadProbeType>(kPackets), &SealedStreams::on_packets, &streams, nullptr);
    gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
    const Owned<GstBus> bus(gst_element_get_bus(pipeline.get()));
    const Owned<GstMessage> ended(gst_bus_timed_pop_filtered(
        bus.get(), 30 * GST_SECOND, static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR)));
    EXPECT_TRUE(ended && GST_MESSAGE_TYPE(ended.get()) == GST_MESSAGE_EOS);
    gst_element_set_state(pipeline.get(), GST_STATE_NULL);
    return streams;
  }
  static void note(GstBuffer* packet, std::set<std::uint32_t>& streams) {
    std::array<std::uint8_t, 12> header{};
    ASSERT_EQ(gst_buffer_extract(packet, 0, header.data(), header.size()), header.size());
    std::uint32_t ssrc = 0;
    for (std::size_t i = 8; i < 12; ++i) ssrc = ssrc << 8 | header[i];
    streams.insert(ssrc);
  }
  static GstPadProbeReturn on_packets(GstPad* /*pad*/, GstPadProbeInfo* info, gpointer to) {
    auto& streams = *static_cast<std::set<std::uint32_t>*>(to);
    if ((GST_PAD_PROBE_INFO_TYPE(info) & GST_PAD_PROBE_TYPE_BUFFER) != 0) {
      note(GST_PAD_PROBE_INFO_BUFFER(info), streams);
      return GST_PAD_PROBE_OK;
    }
    GstBufferList* packets = GST_PAD_PROBE_INFO_BUFFER_LIST(info);
    for (guint i = 0; i < gst_buffer_list_length(packets); ++i) note(gst_buffer_list_get(packets, i), streams);
    return GST_PAD_PROBE_OK;
  }

  static constexpr std::uint16_t kAllButTwo = 0xFFFF - 2;
  Sealer sealer_{kAllButTwo};
};

TEST_F(SealedStreams, EndWithTheLastNumberOfAKeyAndBeginWithTheNextKey) {
  sealer_.set_key(key_of(1));
  const auto last_but_one = run(), last = run();
  ASSERT_EQ(last_but_one.size(), 1u);
  ASSERT_EQ(last.size(), 1u);
  EXPECT_EQ(*last.begin() & 0xFFFF, 0xFFFFu);
  EXPECT_EQ(*last_but_one.begin() + 1, *last.begin());
  EXPECT_TRUE(run().empty()) << "its numbers would be used again";
  sealer_.set_key(key_of(1));
  EXPECT_TRUE(run().empty()) << "the same key is no other one";
  sealer_.set_key(key_of(2));
  EXPECT_EQ(run().size(), 1u);
}

TEST_F(SealedStreams, AreOthersWhereAKeyIsTakenAwayAndGivenAgain) {
  sealer_.set_key(key_of(1));
  const auto first = run();
  sealer_.set_key(std::nullopt);
  EXPECT_TRUE(run().empty());
  sealer_.set_key(key_of(1));
  const auto again = run();
  ASSERT_EQ(again.size(), 1u);
  EXPECT_NE(first, again);
}

}  // namespace
}  // namespace knuckle::video
