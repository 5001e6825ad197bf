#include "app/session/session_result.h"

namespace knuckle::session {

Judged judge(const SessionResult& session) {
  std::vector<Criterion> criteria = session.criteria;
  // A session whose record has gaps is not passed, whatever its criteria.
  if (session.record.records_lost > 0)
    criteria.insert(criteria.begin(), {"records_lost", {}, 0, CriterionKind::kSafety});
  Judged judged{session, compute_metrics(session.record), {}, {}};
  judged.criteria = evaluate(criteria, judged.metrics, session.record);
  const bool passed = all_passed(judged.criteria, session.requirements_decide);
  if (!passed || !session.record.cut_short) judged.passed = passed;
  return judged;
}

}  // namespace knuckle::session
