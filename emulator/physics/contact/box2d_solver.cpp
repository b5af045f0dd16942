#include "physics/contact/box2d_solver.h"

#include <box2d/box2d.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/clock.h"
#include "base/trigonometry.h"

namespace kilotwin {

namespace {

constexpr double RADIUS_UNITS = 0.1;
constexpr int ROUND_WALL_SEGMENTS = 720;  // a 19.2 m arena differs from a circle by 0.1 mm
constexpr int SUB_STEPS = 16;
constexpr double SPECULATIVE_UNITS = 0.018;  // Box2D's margin is 0.02

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
        b2Transform now;  ///< while enabled
    };

    b2WorldId world;
    double units_per_m;
    std::vector<Disc> discs;        ///< by robot
    std::vector<uint32_t> enabled;  ///< robots of the last step, ascending

    b2Vec2 to_units(const Eigen::Vector2d &v) const {
        return {static_cast<float>(v.x() * units_per_m), static_cast<float>(v.y() * units_per_m)};
    }

    void build_walls(const Arena &arena) {
        std::vector<b2Vec2> corners;
        if (arena.bounds.shape == Region::Shape::CIRCLE) {
            double half = PI / ROUND_WALL_SEGMENTS;
            double radius = arena.bounds.size.x() / 2 / direction(half).x();
            for (int i = 0; i < ROUND_WALL_SEGMENTS; i++)  // clockwise: solid from within
                corners.push_back(to_units(radius * direction(-2 * half * i)));
        } else {
            Eigen::Vector2d half = arena.bounds.size / 2;
            for (const auto &sign : {Eigen::Vector2d(-1, -1), Eigen::Vector2d(-1, 1),
                                     Eigen::Vector2d(1, 1), Eigen::Vector2d(1, -1)})
                corners.push_back(to_units(half.cwiseProduct(sign)));
        }
        b2BodyDef ground = b2DefaultBodyDef();
        b2SurfaceMaterial material = b2DefaultSurfaceMaterial();
        material.friction = static_cast<float>(FRICTION);
        b2ChainDef chain = b2DefaultChainDef();
        chain.points = corners.data();
        chain.count = static_cast<int>(corners.size());
        chain.materials = &material;
        chain.materialCount = 1;
        chain.isLoop = true;
        b2CreateChain(b2CreateBody(world, &ground), &chain);
    }

    void set_velocity(const Disc &disc, const Shift &velocity) const {
        b2Body_SetLinearVelocity(disc.body, to_units(velocity.by));
        b2Body_SetAngularVelocity(disc.body, static_cast<float>(velocity.turn));
    }

    Shift velocity(const Disc &disc) const {
        const b2Vec2 v = b2Body_GetLinearVelocity(disc.body);
        return {Eigen::Vector2d(v.x, v.y) / units_per_m, b2Body_GetAngularVelocity(disc.body)};
    }

    /// Makes a disc static, so that nothing pushes it, or dynamic.
    static void set_fixed(const Disc &disc, bool fixed) {
        const b2BodyType type = fixed ? b2_staticBody : b2_dynamicBody;
        if (b2Body_GetType(disc.body) != type) b2Body_SetType(disc.body, type);
    }

    /// Enables the bodies of this step, and disables the others.
    void update_enabled(const Islands &islands) {
        std::vector<uint32_t> robots;
        robots.reserve(islands.bodies.size());
        for (const auto &body : islands.bodies) robots.push_back(body.robot);
        for (uint32_t robot : enabled)
            if (!std::binary_search(robots.begin(), robots.end(), robot))
                b2Body_Disable(discs[robot].body);
        for (const auto &body : islands.bodies) {
            if (!std::binary_search(enabled.begin(), enabled.end(), body.robot))
                enable(discs[body.robot], body.pose, body.driven.velocity);
            set_fixed(discs[body.robot], body.fixed);
        }
        enabled.swap(robots);
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
    Shift find_moved(Disc &disc) const {
        const auto [p0, q0] = disc.now;
        const auto [p, q] = disc.now = b2Body_GetTransform(disc.body);
        const double sine = static_cast<double>(q.s) * q0.c - static_cast<double>(q.c) * q0.s;
        const Eigen::Vector2d by(static_cast<double>(p.x) - p0.x, static_cast<double>(p.y) - p0.y);
        return {by / units_per_m, q.s == q0.s && q.c == q0.c ? 0 : small_angle(sine)};
    }

    void create(Disc &disc) {
        b2BodyDef def = b2DefaultBodyDef();
        def.type = b2_dynamicBody;
        def.enableSleep = false;
        def.isEnabled = false;
        disc.body = b2CreateBody(world, &def);
        b2ShapeDef shape = b2DefaultShapeDef();
        shape.material.friction = static_cast<float>(FRICTION);
        b2Circle circle = {{0, 0}, static_cast<float>(RADIUS_UNITS)};
        b2CreateCircleShape(disc.body, &shape, &circle);
    }
};

Box2DSolver::Box2DSolver(const Arena &arena, const Mechanics &mechanics, size_t robots)
    : box2d_(std::make_unique<Box2D>()),
      mechanics_(mechanics) {
    auto &b = *box2d_;
    b.units_per_m = RADIUS_UNITS / mechanics.radius_m;
    b2WorldDef def = b2DefaultWorldDef();
    def.gravity = {0, 0};
    def.enableSleep = false;
    def.maxContactPushSpeed = static_cast<float>(mechanics.part_m_s * b.units_per_m);
    def.maximumLinearSpeed = static_cast<float>(mechanics.fastest_m_s * b.units_per_m);
    b.world = b2CreateWorld(&def);
    b.discs.resize(robots);
    b.build_walls(arena);
}

Box2DSolver::~Box2DSolver() { b2DestroyWorld(box2d_->world); }

// Box2D finds a contact only when bodies are within the speculative margin as its step begins: a
// tick is divided so that two robots do not close by more within one.
void Box2DSolver::solve(Islands &islands, double step_s) {
    auto &b = *box2d_;
    b.update_enabled(islands);
    if (islands.bodies.empty()) return;
    double fastest_m_s = 0;
    for (const auto &body : islands.bodies)
        fastest_m_s = std::max(fastest_m_s, body.free.by.norm() / step_s);
    const double approach_units = 2 * fastest_m_s * TICK_S * b.units_per_m;
    const int rounds = std::max(1, static_cast<int>(std::ceil(approach_units / SPECULATIVE_UNITS)));
    const auto ticks = std::lround(step_s / TICK_S);
    const auto force = mechanics_.change_in(TICK_S);
    for (int tick = 0; tick < ticks; tick++) {
        for (auto &body : islands.bodies) {
            body.driven.drive(body.free.velocity(step_s), force);
            b.set_velocity(b.discs[body.robot], body.driven.velocity);
        }
        for (int round = 0; round < rounds; round++)
            b2World_Step(b.world, static_cast<float>(TICK_S / rounds), SUB_STEPS);
        for (auto &body : islands.bodies) body.driven.velocity = b.velocity(b.discs[body.robot]);
    }
    for (auto &body : islands.bodies) body.moved = b.find_moved(b.discs[body.robot]);
}

std::string box2d_version() {
    b2Version v = b2GetVersion();
    return std::to_string(v.major) + "." + std::to_string(v.minor) + "." +
           std::to_string(v.revision);
}

}  // namespace kilotwin
