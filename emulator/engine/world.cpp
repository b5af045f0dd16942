#include "engine/world.h"

#include <box2d/box2d.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/trigonometry.h"

namespace kilotwin {

namespace {

constexpr double RADIUS_UNITS = 0.1;
constexpr int ROUND_WALL_SEGMENTS = 720;  // a 19.2 m arena differs from a circle by 0.1 mm
constexpr int SUB_STEPS = 4, SUB_STEPS_CAREFUL = 8;
constexpr double SOME_OVERLAP = 0.01, MUCH_OVERLAP = 0.02;  // of a diameter
constexpr int ROUNDS_CAREFUL = 3;
constexpr double SPECULATIVE_UNITS = 0.018;  // Box2D's margin is 0.02

// The series of asin: a step turns a robot by little, and its sine is what Box2D's rotations give
// exactly.
double small_angle(double sine) {
    double square = sine * sine;
    return sine * (1 + square * (1.0 / 6 + square * (3.0 / 40 + square * (15.0 / 336))));
}

}  // namespace

struct World::Box2D {
    struct Disc {
        b2BodyId body = b2_nullBodyId;
        b2Transform now;  ///< while enabled
    };

    b2WorldId world;
    double units_per_m;
    double push_m_s2, push_rad_s2;
    bool gives_way;
    std::vector<Disc> discs;
    std::vector<bool> enabled;  ///< which of them
    std::vector<size_t> crowd;  ///< of robots(), those that it solves in this step

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
            for (auto sign : {Eigen::Vector2d(-1, -1), Eigen::Vector2d(-1, 1),
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

    void drive(Driven &driven, const Shift &free, double step_s, double time_s) const {
        driven.drive({free.by / step_s, free.turn / step_s}, push_m_s2 * time_s,
                     push_rad_s2 * time_s);
    }

    void set_velocity(const Disc &disc, const Shift &velocity) const {
        b2Body_SetLinearVelocity(disc.body, to_units(velocity.by));
        b2Body_SetAngularVelocity(disc.body, static_cast<float>(velocity.turn));
    }

    Shift velocity(const Disc &disc) const {
        const b2Vec2 v = b2Body_GetLinearVelocity(disc.body);
        return {Eigen::Vector2d(v.x, v.y) / units_per_m, b2Body_GetAngularVelocity(disc.body)};
    }

    /// Lets nobody push a robot that stands.
    static void stand_firm(const Disc &disc, bool firm) {
        const b2BodyType type = firm ? b2_staticBody : b2_dynamicBody;
        if (b2Body_GetType(disc.body) != type) b2Body_SetType(disc.body, type);
    }

    void enable(uint32_t robot, const Pose &pose, const Shift &velocity) {
        if (enabled[robot]) return;
        auto &disc = discs[robot];
        if (B2_IS_NULL(disc.body)) create(disc);
        const Eigen::Vector2d ahead = direction(pose.heading);
        b2Body_SetTransform(disc.body, to_units(pose.position),
                            {static_cast<float>(ahead.x()), static_cast<float>(ahead.y())});
        disc.now = b2Body_GetTransform(disc.body);
        b2Body_Enable(disc.body);  // first: a disabled body has no velocity
        set_velocity(disc, velocity);
        enabled[robot] = true;
    }

    void disable(uint32_t robot) {
        if (!enabled[robot]) return;
        b2Body_Disable(discs[robot].body);
        enabled[robot] = false;
    }

    /// Where a step brought a robot.
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

World::World(const Arena &arena, const Profile &profile, double drive_m_s, double fastest_m_s,
             size_t robots)
    : box2d_(std::make_unique<Box2D>()),
      driven_(robots),
      held_(robots, false),
      encounter_{profile.radius_m, drive_m_s, fastest_m_s} {
    auto &b = *box2d_;
    b.units_per_m = RADIUS_UNITS / profile.radius_m;
    b.push_m_s2 = profile.push_m_s2;
    b.gives_way = profile.gives_way;
    b.push_rad_s2 = 2 * profile.push_m_s2 / profile.radius_m;  // a disc's inertia is m r^2 / 2
    b2WorldDef def = b2DefaultWorldDef();
    def.gravity = {0, 0};
    def.enableSleep = false;
    def.maxContactPushSpeed = static_cast<float>(drive_m_s * b.units_per_m);
    def.maximumLinearSpeed = static_cast<float>(fastest_m_s * b.units_per_m);
    b.world = b2CreateWorld(&def);
    b.discs.resize(robots);
    b.enabled.resize(robots);
    b.build_walls(arena);
}

World::~World() { b2DestroyWorld(box2d_->world); }

void World::add(uint32_t robot, const Trajectory &trajectory, Cycles at) {
    const Eigen::Vector2d ahead = trajectory.ahead(at), v = trajectory.drive().velocity;
    auto &driven = driven_[robot];
    driven.velocity = {
        {ahead.x() * v.x() - ahead.y() * v.y(), ahead.y() * v.x() + ahead.x() * v.y()},
        trajectory.drive().turn};
    driven.wanted = driven.velocity;
    held_[robot] = added_ = true;
    robots_.push_back(robot);
}

void World::remove(uint32_t robot) {
    box2d_->disable(robot);
    held_[robot] = false;
    removed_ = true;
}

void World::settle() {
    auto gone = [this](uint32_t robot) { return !held_[robot]; };
    if (removed_)
        robots_.erase(std::remove_if(robots_.begin(), robots_.end(), gone), robots_.end());
    if (added_) std::sort(robots_.begin(), robots_.end());
    added_ = removed_ = false;
}

double World::margin_m(double radius_m) { return SPECULATIVE_UNITS / RADIUS_UNITS * radius_m; }

void World::step(std::vector<Near> &near, double step_s, double approach_m, double overlap) {
    auto &b = *box2d_;
    b.crowd.clear();
    const size_t count = near.size();
    for (size_t i = 0; i < count; i++) {
        if (near[i].company == Near::Company::SEVERAL) {
            b.enable(robots_[i], near[i].pose, driven_[robots_[i]].velocity);
            b.crowd.push_back(i);
        } else {
            b.disable(robots_[i]);
            meet(near, i, step_s);
        }
    }
    solve(near, step_s, approach_m, overlap);
}

/// It stands, and does not give way.
bool World::firm(const Near &near) const {
    return !box2d_->gives_way && near.free.by.isZero(0) && near.free.turn == 0;
}

void World::drive(uint32_t robot, Near &near, double step_s) {
    near.moved = {};
    if (firm(near))
        driven_[robot] = {};
    else
        box2d_->drive(driven_[robot], near.free, step_s, step_s);
}

/// The i-th, who is not in a crowd, and whom it meets: of two, the first sees to both.
void World::meet(std::vector<Near> &near, size_t i, double step_s) {
    using Company = Near::Company;
    Near &one = near[i];
    if (one.company == Company::ROBOT && i > one.other) return;
    drive(robots_[i], one, step_s);
    const Party robot = {driven_[robots_[i]], one.moved};
    if (one.company == Company::NOTHING) {
        robot.move(step_s);
    } else if (one.company == Company::WALL) {
        encounter_.meet(robot, nullptr, one.towards, one.gap_m, step_s);
    } else {
        Near &other = near[one.other];
        drive(robots_[one.other], other, step_s);
        const Party mate = {driven_[robots_[one.other]], other.moved};
        if (firm(other))
            encounter_.meet(robot, nullptr, one.towards, one.gap_m, step_s);
        else if (firm(one))
            encounter_.meet(mate, nullptr, other.towards, one.gap_m, step_s);
        else
            encounter_.meet(robot, &mate, one.towards, one.gap_m, step_s);
    }
}

// A contact is seen by the solver only when bodies are nearer than its speculative margin at the
// begin of a solver step: two robots must not come closer than that within one.
void World::solve(std::vector<Near> &near, double step_s, double approach_m, double overlap) {
    auto &b = *box2d_;
    if (b.crowd.empty()) return;
    if (!b.gives_way)
        for (size_t i : b.crowd) b.stand_firm(b.discs[robots_[i]], firm(near[i]));
    const int care = overlap > MUCH_OVERLAP ? ROUNDS_CAREFUL : 1;
    const int rounds =
        std::max(care, static_cast<int>(std::ceil(approach_m * b.units_per_m / SPECULATIVE_UNITS)));
    const double round_s = step_s / rounds;
    for (int round = 0; round < rounds; round++) {
        for (size_t i : b.crowd) {
            auto &driven = driven_[robots_[i]];
            b.drive(driven, near[i].free, step_s, round_s);
            b.set_velocity(b.discs[robots_[i]], driven.velocity);
        }
        b2World_Step(b.world, static_cast<float>(round_s),
                     overlap > SOME_OVERLAP ? SUB_STEPS_CAREFUL : SUB_STEPS);
        for (size_t i : b.crowd) driven_[robots_[i]].velocity = b.velocity(b.discs[robots_[i]]);
    }
    for (size_t i : b.crowd) near[i].moved = b.find_moved(b.discs[robots_[i]]);
}

std::string box2d_version() {
    b2Version v = b2GetVersion();
    return std::to_string(v.major) + "." + std::to_string(v.minor) + "." +
           std::to_string(v.revision);
}

}  // namespace kilotwin
