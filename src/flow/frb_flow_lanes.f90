!> Blocks of bodies, one per SIMD lane: what the loops of frb_flow_block and frb_flow_block_long work on.
module frb_flow_lanes
    use frb_kinds, only: wp
    implicit none
    private

    public :: lanes, block_of_bodies, workspace

    integer, parameter :: lanes = 24    !! bodies in a block: a few vectors, and memory keeps up

    !> A block in sorted principal axes, right-handed: an odd sorting turns the sign of the last one.
    type :: block_of_bodies
        real(wp) :: alpha(lanes), beta(lanes), gamma(lanes), a1(lanes), a3(lanes)
        real(wp) :: m(lanes, 3), q(lanes, 0:3)
        integer :: served(lanes)        !! 1 where flow_block advances the body, else 0
    end type block_of_bodies

    !> What the loops hand to one another, one number a lane.
    type :: workspace
        real(wp) :: gg(lanes)                                       !! square of the momentum
        real(wp) :: a(lanes), b(lanes), g(lanes), p(lanes), r(lanes), nu(lanes), k(lanes)
        real(wp) :: form(lanes)                                     !! 1: first form, -1: its mirror image
        real(wp) :: long(lanes)                                     !! 1: beyond the short series, else 0
        real(wp) :: long_p(lanes), long_r(lanes), long_nu(lanes)    !! p, r, nu of long lanes, see sort_lanes
        real(wp) :: y(lanes), scd(lanes), third(lanes)              !! s^2, s c d, H of short steps
        real(wp) :: d1(lanes), d2(lanes), d3(lanes)                 !! increments of the momentum
        real(wp) :: w0(lanes), w1(lanes), w2(lanes), w3(lanes)      !! the turn e z - 1
    end type workspace

end module frb_flow_lanes
