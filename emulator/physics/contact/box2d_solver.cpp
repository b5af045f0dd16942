#include "physics/contact/box2d_solver.h"

#include <box2d/box2d.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/clock.h"
#include "base/errors.h"
#include "base/trigonometry.h"

namespace kilotwin {

namespace {

constexpr double RADIUS_UNITS = 0.1;
constexpr double INERTIA = RADIUS_UNITS * RADIUS_UNITS / 2;  // of a disc of mass 1
constexpr int ROUND_WALL_SEGMENTS = 720;  // a 19.2 m arena differs from a circle by 0.1 mm
constexpr int ORACLE_SUB_STEPS = 16;      // a tick

// Taylor series of asin: Box2D's rotations give the sine exactly, and a step turns a robot by
// little.
double small_angle(double sine) {
    double square = sine * sine;
    return sine * (1 + square * (1.0 / 6 + square * (3.0 / 40 + square * (15.0 / 336))));
}

}  // namespace

struct Box2DSolver::Box2D {
    struct Disc {
        b2BodyId body = b2_nullBodyId;
        b2Transform now;       ///< while enabled
        uint64_t enabled = 0;  ///< the count of `calls` in which it was last in an island
        bool fixed = false;
    };

    /// An object.
    struct Thing {
        b2BodyId body;
        b2Transform now;  ///< while enabled
        double radius_m;  ///< around all of it
        bool enabled = false;
    };

    b2WorldId world;
    double units_per_m = 0;
    std::vector<Thing> things;      ///< by object
    std::vector<Disc> discs;        ///< by robot
    std::vector<uint32_t> enabled;  ///< robots of the last step, ascending
    uint64_t calls = 1;             ///< of update_enabled(), and one

    b2Vec2 to_units(const Eigen::Vector2d &v) const {
        return {static_cast<float>(v.x() * units_per_m), static_cast<float>(v.y() * units_per_m)};
    }

    std::vector<b2Vec2> all_to_units(const std::vector<Eigen::Vector2d> &points) const {
        std::vector<b2Vec2> units(points.size());
        std::transform(points.begin(), points.end(), units.begin(),
                       [this](const auto &point) { return to_units(point); });
        return units;
    }

    /// One-sided: solid on the right of those who go along it. A loop of at least three corners.
    void build_chain(b2BodyId ground, const std::vector<Eigen::Vector2d> &corners) const {
        std::vector<b2Vec2> points = all_to_units(corners);
        // Box2D wants four at least.
        if (points.size() == 3) points.push_back(to_units((corners.front() + corners.back()) / 2));
        b2SurfaceMaterial material = b2DefaultSurfaceMaterial();
        material.friction = static_cast<float>(FRICTION);
        b2ChainDef chain = b2DefaultChainDef();
        chain.points = points.data();
        chain.count = static_cast<int>(points.size());
        chain.materials = &material;
        chain.materialCount = 1;
        chain.isLoop = true;
        b2CreateChain(ground, &chain);
    }

    void build_walls(const Arena &arena) {
        const b2BodyDef def = b2DefaultBodyDef();
        const b2BodyId ground = b2CreateBody(world, &def);
        std::vector<Eigen::Vector2d> corners = arena.bounds.outline();
        // Clockwise: solid from within.
        if (!corners.empty()) std::reverse(corners.begin() + 1, corners.end());
        if (arena.bounds.shape == Region::Shape::CIRCLE) {
            double half = PI / ROUND_WALL_SEGMENTS;
            double radius = arena.bounds.size.x() / 2 / direction(half).x();
            for (int i = 0; i < ROUND_WALL_SEGMENTS; i++)
                corners.push_back(radius * direction(-2 * half * i));
        }
        build_chain(ground, corners);
        for (const auto &obstacle : arena.obstacles)
            if (obstacle.shape.shape == Region::Shape::CIRCLE)
                build_pillar(ground, obstacle.shape);
            else
                build_chain(ground, obstacle.shape.outline());
    }

    void build_pillar(b2BodyId ground, const Region &shape) const {
        b2ShapeDef def = b2DefaultShapeDef();
        def.material.friction = static_cast<float>(FRICTION);
        const b2Circle circle = {to_units(shape.centre),
                                 static_cast<float>(shape.size.x() / 2 * units_per_m)};
        b2CreateCircleShape(ground, &def, &circle);
    }

    void set_velocity(const Disc &disc, const Shift &velocity) const {
        b2Body_SetLinearVelocity(disc.body, to_units(velocity.by));
        b2Body_SetAngularVelocity(disc.body, static_cast<float>(velocity.turn));
    }

    Shift velocity(b2BodyId body) const {
        const b2Vec2 v = b2Body_GetLinearVelocity(body);
        return {Eigen::Vector2d(v.x, v.y) / units_per_m, b2Body_GetAngularVelocity(body)};
    }

    /// Lets the drive act in each of the next sub-steps of `h_s`, which is less than 1 / rates:
    /// changes the velocity by rate * h_s of what it lacks. Box2D's damping divides by 1 + d * h_s.
    void set_drive(const Disc &disc, const Shift &wanted, const DrivenBody::Rates &rates,
                   double h_s) const {
        auto damping = [h_s](double rate) { return static_cast<float>(rate / (1 - rate * h_s)); };
        b2Body_SetLinearDamping(disc.body, damping(rates.by_per_s));
        b2Body_SetAngularDamping(disc.body, damping(rates.turn_per_s));
        b2Body_ApplyForceToCenter(disc.body, to_units(rates.by_per_s * wanted.by), false);
        b2Body_ApplyTorque(disc.body, static_cast<float>(INERTIA * rates.turn_per_s * wanted.turn),
                           false);
    }

    /// The table's friction is a joint that wants the velocity to be 0, with a limited force.
    void create_thing(const Object &object, double robot_kg, b2BodyId table) {
        b2BodyDef def = b2DefaultBodyDef();
        def.type = b2_dynamicBody;
        Thing thing = {b2CreateBody(world, &def), {}, object.radius_m()};
        b2ShapeDef shape = b2DefaultShapeDef();
        // Box2D takes the geometric mean of two shapes' friction.
        const double own = object.robot_friction() * object.robot_friction() / FRICTION;
        shape.material.friction = static_cast<float>(own);
        shape.enableContactEvents = false;
        const double area_units = object.area_m2() * units_per_m * units_per_m;
        shape.density = static_cast<float>(object.mass_kg() / robot_kg / area_units);
        for (const auto &part : object.parts()) add_part(thing.body, shape, part);
        b2MotorJointDef joint = b2DefaultMotorJointDef();
        joint.bodyIdA = table;
        joint.bodyIdB = thing.body;
        joint.correctionFactor = 0;
        joint.maxForce = static_cast<float>(object.most_force_n() / robot_kg * units_per_m);
        joint.maxTorque =
            static_cast<float>(object.most_torque_nm() / robot_kg * units_per_m * units_per_m);
        b2CreateMotorJoint(world, &joint);
        b2Body_Disable(thing.body);
        things.push_back(thing);
    }

    void add_part(b2BodyId body, const b2ShapeDef &shape, const ObjectPart &part) const {
        if (part.corners.empty()) {
            const b2Circle circle = {to_units(part.centre),
                                     static_cast<float>(part.radius_m * units_per_m)};
            b2CreateCircleShape(body, &shape, &circle);
            return;
        }
        const std::vector<b2Vec2> corners = all_to_units(part.corners);
        const b2Hull hull = b2ComputeHull(corners.data(), static_cast<int>(corners.size()));
        if (hull.count == 0) throw EngineError("a part of an object is too thin or too small");
        const b2Polygon polygon = b2MakePolygon(&hull, 0);
        b2CreatePolygonShape(body, &shape, &polygon);
    }

    /// Enables the objects of this step, and disables the others.
    void update_things(const Islands &islands) {
        auto next = islands.objects.begin();
        for (uint32_t i = 0; i < things.size(); i++) {
            Thing &thing = things[i];
            const bool pushed = next != islands.objects.end() && next->object == i;
            if (pushed && !thing.enabled) enable(thing, next->state);
            if (!pushed && thing.enabled) b2Body_Disable(thing.body);
            thing.enabled = pushed;
            if (pushed) ++next;
        }
    }

    void enable(Thing &thing, const ObjectState &state) {
        const Eigen::Vector2d ahead = direction(state.pose.heading);
        b2Body_SetTransform(thing.body, to_units(state.pose.position),
                            {static_cast<float>(ahead.x()), static_cast<float>(ahead.y())});
        thing.now = b2Body_GetTransform(thing.body);
        b2Body_Enable(thing.body);
        b2Body_SetLinearVelocity(thing.body, to_units(state.velocity.by));
        b2Body_SetAngularVelocity(thing.body, static_cast<float>(state.velocity.turn));
    }

    /// Keeps the rim of what turns below a speed: robots are looked for that far.
    void limit_turning(const Islands &islands, double most_m_s) const {
        for (const auto &pushed : islands.objects) {
            const Thing &thing = things[pushed.object];
            const auto most = static_cast<float>(most_m_s / thing.radius_m);
            const float turn = b2Body_GetAngularVelocity(thing.body);
            if (std::abs(turn) > most)
                b2Body_SetAngularVelocity(thing.body, turn > 0 ? most : -most);
        }
    }

    /// Makes a disc static, so that nothing pushes it, or dynamic.
    static void set_fixed(Disc &disc, bool fixed) {
        if (disc.fixed == fixed) return;
        b2Body_SetType(disc.body, fixed ? b2_staticBody : b2_dynamicBody);
        disc.fixed = fixed;
    }

    /// Enables the bodies of this step, and disables the others. Those that stay keep their
    /// contacts, and so their impulses.
    void update_enabled(const Islands &islands) {
        const uint64_t last = calls++;
        for (const auto &body : islands.bodies) {
            Disc &disc = discs[body.robot];
            if (disc.enabled != last) enable(disc, body.pose, body.driven.velocity);
            disc.enabled = calls;
            set_fixed(disc, body.fixed);
        }
        for (uint32_t robot : enabled)
            if (discs[robot].enabled != calls) b2Body_Disable(discs[robot].body);
        enabled.clear();
        for (const auto &body : islands.bodies) enabled.push_back(body.robot);
    }

    void enable(Disc &disc, const Pose &pose, const Shift &velocity) {
        if (B2_IS_NULL(disc.body)) create(disc);
        const Eigen::Vector2d ahead = direction(pose.heading);
        b2Body_SetTransform(disc.body, to_units(pose.position),
                            {static_cast<float>(ahead.x()), static_cast<float>(ahead.y())});
        disc.now = b2Body_GetTransform(disc.body);
        b2Body_Enable(disc.body);  // first: a disabled body has no velocity
        set_velocity(disc, velocity);
    }

    /// Displacement since the last call, or since enable().
    template <typename Kind> Shift find_moved(Kind &body) const {
        const auto [p0, q0] = body.now;
        const auto [p, q] = body.now = b2Body_GetTransform(body.body);
        const double sine = static_cast<double>(q.s) * q0.c - static_cast<double>(q.c) * q0.s;
        const Eigen::Vector2d by(static_cast<double>(p.x) - p0.x, static_cast<double>(p.y) - p0.y);
        return {by / units_per_m, small_angle(sine)};
    }

    void create(Disc &disc) {
        b2BodyDef def = b2DefaultBodyDef();
        def.type = b2_dynamicBody;
        def.isEnabled = false;
        disc.body = b2CreateBody(world, &def);
        b2ShapeDef shape = b2DefaultShapeDef();
        shape.material.friction = static_cast<float>(FRICTION);
        shape.enableContactEvents = false;
        shape.density = static_cast<float>(1 / (PI * RADIUS_UNITS * RADIUS_UNITS));
        b2Circle circle = {{0, 0}, static_cast<float>(RADIUS_UNITS)};
        b2CreateCircleShape(disc.body, &shape, &circle);
    }
};

Box2DSolver::Box2DSolver(const Arena &arena, const Mechanics &mechanics, size_t robots,
                         const std::vector<Object> &objects, Accuracy accuracy)
    : IslandSolver(arena, mechanics),
      box2d_(std::make_unique<Box2D>()),
      accuracy_(accuracy) {
    auto &b = *box2d_;
    b.units_per_m = RADIUS_UNITS / mechanics.radius_m;
    b.discs.resize(robots);
    b2WorldDef def = b2DefaultWorldDef();
    def.gravity = {0, 0};
    def.enableSleep = false;
    def.maxContactPushSpeed = static_cast<float>(mechanics_.part_m_s * b.units_per_m);
    def.maximumLinearSpeed = static_cast<float>(mechanics_.fastest_m_s * b.units_per_m);
    b.world = b2CreateWorld(&def);
    if (B2_IS_NULL(b.world))
        throw EngineError("128 open worlds of this process have objects, and Box2D has no more; "
                          "close worlds that you are done with: "
                          "world.close(), or `with World(...) as world:`");
    b.build_walls(arena_);
    const b2BodyDef table = b2DefaultBodyDef();
    const b2BodyId table_id = b2CreateBody(b.world, &table);
    for (const Object &object : objects) b.create_thing(object, mechanics_.mass_kg, table_id);
}

Box2DSolver::~Box2DSolver() { b2DestroyWorld(box2d_->world); }

// Its body is put where it is when it is enabled the next time.
void Box2DSolver::forget(uint32_t robot) {
    auto &disc = box2d_->discs[robot];
    if (!B2_IS_NULL(disc.body)) b2Body_Disable(disc.body);
    disc.enabled = 0;
}

void Box2DSolver::solve(std::vector<Islands> &shares, double step_s) {
    Islands &islands = shares.front();
    box2d_->update_enabled(islands);
    box2d_->update_things(islands);
    if (islands.bodies.empty() && islands.objects.empty()) return;
    if (accuracy_ == Accuracy::ORACLE)
        step_by_ticks(islands, step_s);
    else
        step_once(islands, step_s);
    for (auto &body : islands.bodies) {
        body.moved = box2d_->find_moved(box2d_->discs[body.robot]);
        if (body.at_wall && !body.fixed) keep_off_walls(body);
    }
    for (auto &[object, state] : islands.objects) {
        auto &thing = box2d_->things[object];
        const Shift moved = box2d_->find_moved(thing);
        state.pose.position += moved.by;
        state.pose.heading = wrapped(state.pose.heading + moved.turn);
        state.velocity = box2d_->velocity(thing.body);
    }
}

void Box2DSolver::keep_off_walls(Islands::Body &body) const {
    const Eigen::Vector2d at = body.pose.position + body.moved.by, kept = kept_off_walls(at);
    if (kept == at) return;
    body.moved.by = kept - body.pose.position;
    Box2D::Disc &disc = box2d_->discs[body.robot];
    b2Body_SetTransform(disc.body, box2d_->to_units(kept), disc.now.q);
    disc.now = b2Body_GetTransform(disc.body);
}

void Box2DSolver::step_once(Islands &islands, double step_s) {
    auto &b = *box2d_;
    const auto [rounds, sub_steps] =
        divide(closeness(islands, swept_m(islands, step_s)), step_s, !islands.objects.empty());
    const double round_s = step_s / rounds;
    for (auto &body : islands.bodies) {
        if (body.driven.change_wanted(body.free.velocity(step_s)))
            b.set_velocity(b.discs[body.robot], body.driven.velocity);
    }
    for (int round = 0; round < rounds; round++) {
        for (auto &body : islands.bodies)
            b.set_drive(b.discs[body.robot], body.driven.wanted,
                        body.driven.rates(mechanics_, 1 / TICK_S), round_s / sub_steps);
        b2World_Step(b.world, static_cast<float>(round_s), sub_steps);
        b.limit_turning(islands, mechanics_.fastest_m_s);
        for (auto &body : islands.bodies)
            body.driven.velocity = b.velocity(b.discs[body.robot].body);
    }
}

void Box2DSolver::step_by_ticks(Islands &islands, double step_s) {
    auto &b = *box2d_;
    double fastest_m_s = 0;
    for (const auto &body : islands.bodies)
        fastest_m_s = std::max(fastest_m_s, body.free.by.norm() / step_s);
    const int rounds = rounds_of(2 * fastest_m_s * TICK_S);
    const auto ticks = std::lround(step_s / TICK_S);
    const auto force = mechanics_.change_in(TICK_S);
    for (int tick = 0; tick < ticks; tick++) {
        for (auto &body : islands.bodies) {
            body.driven.drive(body.free.velocity(step_s), force);
            b.set_velocity(b.discs[body.robot], body.driven.velocity);
        }
        for (int round = 0; round < rounds; round++)
            b2World_Step(b.world, static_cast<float>(TICK_S / rounds), ORACLE_SUB_STEPS);
        b.limit_turning(islands, mechanics_.fastest_m_s);
        for (auto &body : islands.bodies)
            body.driven.velocity = b.velocity(b.discs[body.robot].body);
    }
}

/// By the fastest object in a step; below 0 without objects.
double Box2DSolver::swept_m(const Islands &islands, double step_s) const {
    double swept_m = islands.objects.empty() ? -1 : 0;
    for (const auto &[object, state] : islands.objects)
        swept_m = std::max(swept_m, step_s * state.most_m_s(box2d_->things[object].radius_m));
    return swept_m;
}

/// Box2D finds a contact only when bodies are within the speculative margin as its step begins: a
/// step is divided so that two robots do not close by more within one.
int Box2DSolver::rounds_of(double closing_m) const {
    const double seen_m = SEEN_RADII * mechanics_.radius_m;
    return std::max(1, static_cast<int>(std::ceil(closing_m / seen_m)));
}

std::string box2d_version() {
    b2Version v = b2GetVersion();
    return std::to_string(v.major) + "." + std::to_string(v.minor) + "." +
           std::to_string(v.revision);
}

}  // namespace kilotwin
