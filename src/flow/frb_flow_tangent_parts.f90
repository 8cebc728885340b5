!> The numbers that the stages of a step with its derivative share.
module frb_flow_tangent_parts
    use frb_kinds, only: wp
    implicit none
    private

    public :: step_parts

    !> A step seen in the form that is taken, in the axes of that form and in units of the half step t. The
    !> mirror form has the axes (3, 2, 1) and side = -1: a -> (-a3, -a2, -a1), turns change their sign.
    type :: step_parts
        integer :: o1, o2, o3       !! its axes in those of the body
        real(wp) :: s1, s3    !! signs of axes 1 and 3: an odd sorting reverses one
        real(wp) :: side
        real(wp) :: t               !! half step
        real(wp) :: a, b, g          !! alpha t, beta t, gamma t
        real(wp) :: rate                               !! a1 t
        real(wp) :: p, r, nu         !! P t^2, R t^2, nu t^2
        real(wp) :: m1, m2, m3       !! momentum at the start
        real(wp) :: e1, e2, e3       !! and at the end
        real(wp) :: n1, n2, n3       !! and in between
        real(wp) :: gg                                 !! |m|^2
        real(wp) :: y, scd                    !! s^2 and s c d at t
        real(wp) :: s, c, d          !! the triple, for derivatives by the inertia
        real(wp) :: third, dd, aa, bb   !! integrals H, D, A, B
        real(wp) :: own         !! B if c is the cn-like function, else A
        real(wp) :: delta       !! |R - P| t^2
        real(wp) :: cosine, along             !! turn e about m: (cosine, along m)
        logical :: c_is_cn                             !! p >= r
    end type step_parts

end module frb_flow_tangent_parts
