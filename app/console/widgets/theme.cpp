#include "app/console/widgets/theme.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "core/error.h"

namespace knuckle::console {
namespace {

constexpr std::array<const char*, 3> kFiles{"B612-Regular.otf", "B612-Bold.otf", "B612Mono-Bold.otf"};
constexpr std::size_t kRegular = 0, kBold = 1, kMono = 2;
constexpr const char* kDebianFolder = "/usr/share/fonts/opentype/b612";

// Latin, Greek letters, and the few signs that the screens use.
constexpr std::array<ImWchar, 19> kGlyphs{0x20,   0x7E,   0xA0,   0xFF,   0x391,  0x3C9,  0x2010,
                                          0x2026, 0x2030, 0x2030, 0x2190, 0x2195, 0x2212, 0x2212,
                                          0x2248, 0x2248, 0x2264, 0x2265, 0};

std::vector<char> read_font(const std::string& folder, const char* file) {
  const std::string path = folder + "/" + file;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw InputError("font " + path + " is missing: install fonts-b612, or set KNUCKLE_FONT_DIR");
  std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
  // What is no font would end the program inside the rasteriser.
  const std::string magic(bytes.begin(), bytes.begin() + std::min<std::ptrdiff_t>(4, std::ssize(bytes)));
  constexpr std::size_t kSmallest = 1024;
  if ((magic != "OTTO" && magic != std::string("\0\1\0\0", 4)) || bytes.size() < kSmallest)
    throw InputError("font " + path + " is not an OpenType font: install fonts-b612, or set KNUCKLE_FONT_DIR");
  return bytes;
}

/// A mono font's point leaves a hole in every number: "1. 47". Numbers have as many points whatever they are, so a
/// narrower one keeps them from dancing as well.
void narrow_point(ImFont& font) {
  constexpr float kShare = 0.55F;
  for (const ImWchar c : {ImWchar{'.'}, ImWchar{','}, ImWchar{':'}}) {
    auto* glyph = const_cast<ImFontGlyph*>(font.FindGlyphNoFallback(c));
    if (glyph == nullptr) continue;
    const float advance = std::round(glyph->AdvanceX * kShare);
    const float shift = std::round((advance - (glyph->X1 - glyph->X0)) / 2 - glyph->X0);
    glyph->X0 += shift;
    glyph->X1 += shift;
    glyph->AdvanceX = advance;
    font.IndexAdvanceX[c] = advance;
  }
}

}  // namespace

FontFiles::FontFiles() {
  const char* asked = std::getenv("KNUCKLE_FONT_DIR");
  const std::string folder = asked != nullptr && *asked != '\0' ? asked : kDebianFolder;
  for (std::size_t i = 0; i < faces_.size(); ++i) faces_[i] = read_font(folder, kFiles[i]);
}

ImFont* FontFiles::add(ImFontAtlas& atlas, std::size_t face, float size_px) {
  ImFontConfig config;
  config.FontDataOwnedByAtlas = false;
  config.OversampleH = 2;
  config.OversampleV = 1;
  std::vector<char>& bytes = faces_[face];
  return atlas.AddFontFromMemoryTTF(bytes.data(), static_cast<int>(bytes.size()), std::round(size_px), &config,
                                    kGlyphs.data());
}

Fonts FontFiles::build(ImFontAtlas& atlas, float scale) {
  constexpr float kSmall = 15, kBody = 18, kTitle = 22, kDisplay = 34;
  atlas.Clear();
  Fonts fonts;
  fonts.body = add(atlas, kRegular, kBody * scale);  // first: ImGui's default
  fonts.small = add(atlas, kRegular, kSmall * scale);
  fonts.title = add(atlas, kBold, kTitle * scale);
  fonts.display = add(atlas, kBold, kDisplay * scale);
  fonts.body_bold = add(atlas, kBold, kBody * scale);
  fonts.mono_small = add(atlas, kMono, kSmall * scale);
  fonts.mono = add(atlas, kMono, kBody * scale);
  fonts.mono_title = add(atlas, kMono, kTitle * scale);
  fonts.mono_display = add(atlas, kMono, kDisplay * scale);
  if (!atlas.Build()) throw InputError("fonts of fonts-b612 cannot be drawn: install it again");
  for (ImFont* font : {fonts.mono_small, fonts.mono, fonts.mono_title, fonts.mono_display}) narrow_point(*font);
  return fonts;
}

namespace {

constexpr ImU32 rgb(unsigned hex, unsigned alpha = 255) {
  return IM_COL32((hex >> 16) & 255U, (hex >> 8) & 255U, hex & 255U, alpha);
}

constexpr Palette kDark{
    .background = rgb(0x10151A),
    .surface = rgb(0x1A2129),
    .raised = rgb(0x27313B),
    .border = rgb(0x35414D),
    .text = rgb(0xEAF0F5),
    .muted = rgb(0xA6B3BF),
    .accent = rgb(0x56B4E9),
    .good = rgb(0x35C79B),
    .notice = rgb(0xE69F00),
    .bad = rgb(0xFF8A55),
    .stop = rgb(0xC9261C),
    .stop_text = rgb(0xFFFFFF),
    .series = {rgb(0x56B4E9), rgb(0xE69F00), rgb(0x35C79B), rgb(0xCC79A7), rgb(0xF0E442), rgb(0xE8743B)},
    .force = rgb(0xFF8A55),
};

constexpr Palette kLight{
    .background = rgb(0xE6EAEE),
    .surface = rgb(0xFBFCFD),
    .raised = rgb(0xEEF2F5),
    .border = rgb(0xC3CCD5),
    .text = rgb(0x131A21),
    .muted = rgb(0x4A5763),
    .accent = rgb(0x00639C),
    .good = rgb(0x006B4D),
    .notice = rgb(0x875300),
    .bad = rgb(0xA83C00),
    .stop = rgb(0xC9261C),
    .stop_text = rgb(0xFFFFFF),
    .series = {rgb(0x0072B2), rgb(0xC77E00), rgb(0x009E73), rgb(0xB05585), rgb(0x8A7F00), rgb(0xC24A00)},
    .force = rgb(0xC24A00),
};

double luminance(ImU32 colour) noexcept {
  const auto linear = [](ImU32 byte) {
    const double v = static_cast<double>(byte & 255U) / 255;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(colour >> IM_COL32_R_SHIFT) + 0.7152 * linear(colour >> IM_COL32_G_SHIFT) +
         0.0722 * linear(colour >> IM_COL32_B_SHIFT);
}

}  // namespace

const Palette& dark_palette() noexcept {
  return kDark;
}

const Palette& light_palette() noexcept {
  return kLight;
}

double contrast(ImU32 a, ImU32 b) noexcept {
  const double la = luminance(a), lb = luminance(b);
  return (std::max(la, lb) + 0.05) / (std::min(la, lb) + 0.05);
}

ImU32 text_on(ImU32 fill) noexcept {
  constexpr ImU32 kBlack = rgb(0x0B0F13), kWhite = rgb(0xFFFFFF);
  return contrast(fill, kBlack) >= contrast(fill, kWhite) ? kBlack : kWhite;
}

ImU32 mix(ImU32 a, ImU32 b, float share_of_b) noexcept {
  const ImVec4 x = ImGui::ColorConvertU32ToFloat4(a), y = ImGui::ColorConvertU32ToFloat4(b);
  const float s = std::clamp(share_of_b, 0.F, 1.F);
  return ImGui::ColorConvertFloat4ToU32(
      {x.x + (y.x - x.x) * s, x.y + (y.y - x.y) * s, x.z + (y.z - x.z) * s, x.w + (y.w - x.w) * s});
}

ImU32 Theme::mode_colour(Mode mode) noexcept {
  static constexpr auto kColours = std::to_array<ImU32>({rgb(0x5B6874),    // off
                                                         rgb(0x7C6BB0),    // self-test
                                                         rgb(0x0072B2),    // ready
                                                         rgb(0xF0E442),    // aligning
                                                         rgb(0x009E73),    // engaged
                                                         rgb(0xE69F00),    // hold
                                                         rgb(0xD55E00),    // fault
                                                         rgb(0xC9261C)});  // E-stop
  static_assert(kColours.size() == number_of_words(Mode{}));
  return kColours[static_cast<std::size_t>(mode)];
}

void apply_style(const Theme& theme) {
  const Palette& c = theme.colours;
  ImGuiStyle style;  // from its defaults each time: measures must not be scaled twice
  style.WindowPadding = {theme.unit(2), theme.unit(1.5F)};
  style.FramePadding = {theme.unit(1.25F), theme.unit(0.75F)};
  style.ItemSpacing = {theme.unit(), theme.unit()};
  style.ItemInnerSpacing = {theme.unit(), theme.unit(0.5F)};
  style.CellPadding = {theme.unit(), theme.unit(0.5F)};
  style.WindowRounding = style.ChildRounding = theme.px(8);
  style.FrameRounding = style.GrabRounding = theme.px(5);
  style.ScrollbarRounding = theme.px(6);
  style.ScrollbarSize = theme.px(12);
  style.GrabMinSize = theme.px(14);
  style.WindowBorderSize = style.ChildBorderSize = style.FrameBorderSize = 0;
  style.DisabledAlpha = 0.5F;

  const auto set = [&style](ImGuiCol which, ImU32 colour) {
    style.Colors[which] = ImGui::ColorConvertU32ToFloat4(colour);
  };
  set(ImGuiCol_Text, c.text);
  set(ImGuiCol_TextDisabled, c.muted);
  set(ImGuiCol_WindowBg, c.background);
  set(ImGuiCol_ChildBg, c.surface);
  set(ImGuiCol_Border, c.border);
  set(ImGuiCol_FrameBg, c.raised);
  set(ImGuiCol_FrameBgHovered, mix(c.raised, c.accent, 0.15F));
  set(ImGuiCol_FrameBgActive, mix(c.raised, c.accent, 0.25F));
  set(ImGuiCol_SliderGrab, c.accent);
  set(ImGuiCol_SliderGrabActive, c.accent);
  set(ImGuiCol_Header, mix(c.surface, c.accent, 0.25F));
  set(ImGuiCol_HeaderHovered, mix(c.surface, c.accent, 0.2F));
  set(ImGuiCol_HeaderActive, mix(c.surface, c.accent, 0.35F));
  set(ImGuiCol_ScrollbarBg, c.surface);
  set(ImGuiCol_ScrollbarGrab, c.border);
  set(ImGuiCol_ScrollbarGrabHovered, c.muted);
  set(ImGuiCol_ScrollbarGrabActive, c.accent);
  set(ImGuiCol_TableHeaderBg, c.raised);
  set(ImGuiCol_TableBorderLight, c.border);
  set(ImGuiCol_TableBorderStrong, c.border);
  set(ImGuiCol_TextSelectedBg, mix(c.surface, c.accent, 0.4F));
  set(ImGuiCol_NavHighlight, c.text);
  ImGui::GetStyle() = style;
}

}  // namespace knuckle::console
