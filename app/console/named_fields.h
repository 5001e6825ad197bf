// Structs that list their members (core/fields.h), handed on member by member.
#pragma once

#include <algorithm>
#include <string_view>
#include <type_traits>

#include "core/fields.h"
#include "core/units.h"

namespace knuckle::console {

/// A member of both goes over by its name. One that only one of them has, or that is of another type there, stays as it
/// is. Allocates nothing.
template <typename From, typename To>
void copy_named(const From& from, To& to) noexcept {
  To::fields(to, [&from](std::string_view name, auto& target, auto&&...) {
    From::fields(from, [&](std::string_view other, const auto& source, auto&&...) {
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(source)>, std::remove_cvref_t<decltype(target)>>)
        if (name == other) target = source;
    });
  });
}

/// Every number of a double's becomes NaN. Times, counts, words and what is said with yes or no stay as they are, and
/// so do structs within.
template <typename Listed>
void make_unknown(Listed& all) noexcept {
  Listed::fields(all, [](std::string_view, auto& member, auto&&...) {
    using Member = std::remove_cvref_t<decltype(member)>;
    if constexpr (std::is_same_v<Member, double>) member = kUnknown;
    if constexpr (VectorField<Member>) std::fill_n(member.data(), member.size(), kUnknown);
  });
}

}  // namespace knuckle::console
