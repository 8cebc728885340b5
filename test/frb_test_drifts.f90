!> Drifts by name: the paper's steps and the free flow in the same loop.
module frb_test_drifts
    use frb_checks, only: tally, worst_of
    use frb_drifts, only: drift_by_name, flow_drift, matrix_drift, quaternion_drift
    use frb_free_flow, only: free_flow, rigid_body
    use frb_invariants, only: kinetic_energy, norm_defect, spatial_momentum
    use frb_kinds, only: wp
    use frb_rotations, only: quat_to_matrix
    use frb_scenes, only: heavy_top
    use frb_schemes, only: splitting_scheme
    use frb_splitting, only: integrate
    use frb_status, only: status_ok, status_bad_momentum, status_bad_option
    use frb_torque, only: body_drift
    use frb_torque_cases, only: top_case, known_top, distance
    implicit none
    private

    public :: test_drifts

    real(wp), parameter :: eps = epsilon(1.0_wp)

contains

    subroutine test_drifts(t)
        type(tally), intent(inout) :: t

        call t%open_suite('drifts', 123)
        call test_runs(t)
        call test_tensors(t)
        call test_almost_aligned(t)
        call test_linear_rotors(t)
        call test_long_turns(t)
        call test_names(t)
        call t%close_suite()
    end subroutine test_drifts

    !> The same run with every drift.
    subroutine test_runs(t)
        type(tally), intent(inout) :: t
        character(12), parameter :: names(5) = [character(12) :: 'free_flow', 'frb_step', 'quat_step', &
                                                'frb_step:10', 'quat_step:10']
        class(body_drift), allocatable :: drift
        type(quaternion_drift) :: other_frame
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(heavy_top) :: top
        real(wp) :: m(3), q(4), m_flow(3), q_flow(4), tensor(3, 3), error(2)
        integer :: i, k, n, stat

        scheme = splitting_scheme('srkn14')
        do k = 1, 2
            item = known_top(k)
            do i = 1, size(names)
                call drift_by_name(trim(names(i)), drift, stat)
                m = item%m0
                q = item%q0
                call integrate(item%body, scheme, item%top, item%t/400, 400, m, q, drift=drift, stat=stat)
                call t%equal(trim(names(i))//'-comes-to-the-end', stat, status_ok)
                call t%at_most(trim(names(i))//'-ends-where-the-taylor-series-does', &
                               distance(m, q, item%m, item%q), 8192*eps)
            end do
        end do
        do i = 2, 3
            other_frame%frame = i
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, item%t/400, 400, m, q, drift=other_frame)
            call t%at_most('the-papers-other-frames-end-there-too', distance(m, q, item%m, item%q), 8192*eps)
        end do

        ! One Gauss point makes the drift, so the run, second order, whatever the scheme.
        do i = 1, 2
            n = 200*i
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, item%t/n, n, m, q, drift=quaternion_drift(points=1))
            error(i) = distance(m, q, item%m, item%q)
        end do
        call t%close_to('one-gauss-point-makes-order-two', log(error(1)/error(2))/log(2.0_wp), 2.0_wp, 0.2_wp)

        ! A body by its tensor, in axes that are not principal.
        tensor = reshape([1.0_wp, 0.2_wp, 0.1_wp, 0.2_wp, 1.5_wp, -0.3_wp, 0.1_wp, -0.3_wp, 2.0_wp], [3, 3])
        do i = 1, 3
            call drift_by_name(trim(names(i)), drift)
            m = [1.0_wp, -0.5_wp, 0.7_wp]
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call integrate(rigid_body(tensor), scheme, top, 0.1_wp, 50, m, q, drift=drift)
            if (i == 1) then
                m_flow = m
                q_flow = q
            else
                call t%at_most('drifts-agree-for-a-body-by-its-tensor', &
                               distance(m, q, m_flow, q_flow), 1024*eps)
            end if
        end do
    end subroutine test_runs

    !> Nearly principal axes: the rotation to principal axes changes components of the momentum by less than
    !> their rounding. |m| wanders and does not drift, for a small element at any place of the tensor.
    subroutine test_almost_aligned(t)
        type(tally), intent(inout) :: t
        character(9), parameter :: names(3) = ['free_flow', 'frb_step ', 'quat_step']
        integer, parameter :: sizes(4) = [4, 8, 11, 14]
        character(2) :: number
        integer, parameter :: rows(3) = [1, 1, 2], columns(3) = [2, 3, 3]
        ! In units of 2^-53 sqrt(steps). Measured: 0.2 to 1.3; 14 to 38 with increments rounded as m is.
        real(wp), parameter :: walk = 4.0_wp
        class(body_drift), allocatable :: drift
        type(heavy_top) :: nothing
        type(splitting_scheme) :: scheme
        real(wp) :: tensor(3, 3), m(3), q(4), off, before, worst
        integer :: i, k, place, steps, stat

        nothing%force = 0.0_wp
        steps = t%many(30000)
        scheme = splitting_scheme('strang')
        do k = 1, size(names)
            call drift_by_name(trim(names(k)), drift)
            do i = 1, size(sizes)
                off = 10.0_wp**(-sizes(i))
                write (number, '(i0)') sizes(i)
                worst = 0.0_wp
                do place = 1, 3
                    tensor = 0.0_wp
                    tensor(1, 1) = 0.2_wp
                    tensor(2, 2) = 0.9_wp
                    tensor(3, 3) = 1.0_wp
                    tensor(rows(place), columns(place)) = off
                    tensor(columns(place), rows(place)) = off
                    m = [0.3_wp, 0.4_wp, 1.2_wp]
                    q = [0.5_wp, -0.5_wp, 0.5_wp, 0.5_wp]
                    before = norm2(m)
                    call integrate(rigid_body(tensor), scheme, nothing, 0.02_wp, steps, m, q, drift=drift, &
                                   stat=stat)
                    worst = worst_of(worst, abs(norm2(m)/before - 1)/(0.5_wp*eps*sqrt(real(steps, wp))))
                    if (stat /= status_ok) worst = huge(worst)
                end do
                call t%at_most(trim(names(k))//'-with-axes-1e-'//trim(number)//'-off-does-not-'// &
                               'drift-in-the-momentum', worst, walk)
            end do
        end do
    end subroutine test_almost_aligned

    !> A body by its tensor conserves as much as the same body by its moments, with every drift, plain and
    !> compensated, by steps of half a radian and of some radians: root mean squares of the errors at the end
    !> over sixteen bodies of each kind, as each error is a random walk. So does a group of such bodies, which
    !> the free flow moves in lanes.
    subroutine test_tensors(t)
        type(tally), intent(inout) :: t
        character(9), parameter :: names(3) = ['free_flow', 'frb_step ', 'quat_step']
        character(11), parameter :: modes(2) = ['plain      ', 'compensated']
        character(8), parameter :: kept(4) = ['energy  ', 'momentum', 'norm    ', 'q-m     ']
        character(5), parameter :: lengths(2) = ['     ', '-long']
        real(wp), parameter :: steps(2) = [0.5_wp, 4.7_wp]
        real(wp), parameter :: moments(3) = [0.6_wp, 0.8_wp, 1.0_wp]
        class(body_drift), allocatable :: drift
        integer, parameter :: n = 16
        type(rigid_body) :: bodies(n)
        real(wp) :: r(3, 3), m0(3), lost(4, 2), x(4), starts(3, n), group(4)
        integer :: i, k, mode, length

        do k = 1, size(names)*size(modes)*size(lengths)
            mode = 1 + mod(k - 1, size(modes))
            length = 1 + mod((k - 1)/size(modes), size(lengths))
            associate (name => names(1 + (k - 1)/(size(modes)*size(lengths))))
                call drift_by_name(trim(name), drift)
                lost = 0.0_wp
                do i = 1, n
                    x = [1.0_wp, sin(10.0_wp*i), cos(17.0_wp*i), sin(23.0_wp*i)]
                    r = quat_to_matrix(x/norm2(x))
                    m0 = (1 + 0.01_wp*i)*[1.8_wp, 0.4_wp, -0.9_wp]
                    bodies(i) = rigid_body(turned_tensor(r))
                    starts(:, i) = matmul(r, m0)
                    lost(:, 1) = lost(:, 1) + lost_by(rigid_body(bodies(i)%moments()), m0, drift, mode == 2, &
                                                      steps(length))**2
                    lost(:, 2) = lost(:, 2) + lost_by(bodies(i), starts(:, i), drift, mode == 2, &
                                                      steps(length))**2
                end do
                lost = sqrt(lost/n)
                do i = 1, 4
                    call t%at_most(trim(name)//'-'//trim(modes(mode))//trim(lengths(length))// &
                                   '-of-a-tensor-keeps-the-'//trim(kept(i))//'-as-of-its-moments', &
                                   lost(i, 2), 3*lost(i, 1) + 2*eps)
                end do
                if (trim(name) /= 'free_flow' .or. mode == 2) cycle
                group = lost_by_group(bodies, starts, steps(length))
                do i = 1, 4
                    call t%at_most('a-group'//trim(lengths(length))//'-of-tensors-keeps-the-'// &
                                   trim(kept(i))//'-as-of-its-moments', group(i), 3*lost(i, 1) + 2*eps)
                end do
            end associate
        end do

    contains

        !> R diag(moments) R^T, symmetric to the last bit.
        pure function turned_tensor(r) result(tensor)
            real(wp), intent(in) :: r(3, 3)
            real(wp) :: tensor(3, 3)

            tensor = matmul(r*spread(moments, 1, 3), transpose(r))
            tensor = (tensor + transpose(tensor))/2
        end function turned_tensor

        !> The errors of `lost_by` for bodies in one batch, root mean squares.
        function lost_by_group(bodies, m0, h) result(lost)
            type(rigid_body), intent(in) :: bodies(:)
            real(wp), intent(in) :: m0(:, :), h
            real(wp) :: lost(4)
            real(wp) :: m(3, size(bodies)), q(4, size(bodies))
            integer :: step, i

            m = m0
            q = spread([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 2, size(bodies))
            do step = 1, t%many(8000)
                call free_flow(bodies, h, m, q)
            end do
            lost = 0.0_wp
            do i = 1, size(bodies)
                lost = lost + lost_between(bodies(i), m0(:, i), m(:, i), q(:, i))**2
            end do
            lost = sqrt(lost/size(bodies))
        end function lost_by_group

        !> The errors of 8000 steps h without torque.
        function lost_by(body, m0, drift, compensated, h) result(lost)
            type(rigid_body), intent(in) :: body
            real(wp), intent(in) :: m0(3)
            class(body_drift), intent(in) :: drift
            logical, intent(in) :: compensated
            real(wp), intent(in) :: h
            real(wp) :: lost(4)
            type(heavy_top) :: weightless
            real(wp) :: m(3), q(4)

            weightless%force = 0.0_wp
            m = m0
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call integrate(body, splitting_scheme('strang'), weightless, h, t%many(8000), m, q, drift=drift, &
                           compensated=compensated)
            lost = lost_between(body, m0, m, q)
        end function lost_by

        !> Relative change of energy and |m|, |q| - 1, and the change of Q m; at the start q = 1.
        function lost_between(body, m0, m, q) result(lost)
            type(rigid_body), intent(in) :: body
            real(wp), intent(in) :: m0(3), m(3), q(4)
            real(wp) :: lost(4)

            lost = [kinetic_energy(body, m)/kinetic_energy(body, m0) - 1, norm2(m)/norm2(m0) - 1, &
                    norm_defect(q), norm2(spatial_momentum(m, q) - m0)/norm2(m0)]
        end function lost_between

    end subroutine test_tensors

    !> Linear rotors, by moments and by a tensor, move by every drift as by the free flow; a momentum along
    !> the axis is refused.
    subroutine test_linear_rotors(t)
        type(tally), intent(inout) :: t
        character(11), parameter :: names(3) = ['frb_step   ', 'quat_step  ', 'quat_step:7']
        real(wp), parameter :: moments(3) = [1.5_wp, 0.0_wp, 1.5_wp]
        class(body_drift), allocatable :: drift
        type(splitting_scheme) :: scheme
        type(rigid_body) :: rotor
        type(heavy_top) :: top
        real(wp) :: m(3), q(4), m_flow(3), q_flow(4), r(3, 3), tensor(3, 3), start(3)
        integer :: i, k, stat

        scheme = splitting_scheme('srkn14')
        do k = 1, 2
            r = quat_to_matrix(merge([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [0.1_wp, -0.7_wp, 0.5_wp, 0.5_wp], &
                                     k == 1))
            tensor = matmul(r*spread(moments, 1, 3), transpose(r))
            if (k == 1) rotor = rigid_body(moments)
            if (k == 2) rotor = rigid_body((tensor + transpose(tensor))/2)
            top%centre = r(:, 2)
            start = matmul(r, [0.7_wp, 0.0_wp, -1.1_wp])
            m_flow = start
            q_flow = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call integrate(rotor, scheme, top, 0.5_wp, 20, m_flow, q_flow)
            do i = 1, size(names)
                call drift_by_name(trim(names(i)), drift)
                m = start
                q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
                call integrate(rotor, scheme, top, 0.5_wp, 20, m, q, drift=drift, stat=stat)
                call t%equal(trim(names(i))//'-moves-a-linear-rotor', stat, status_ok)
                call t%at_most(trim(names(i))//'-moves-a-linear-rotor-as-the-flow-does', &
                               distance(m, q, m_flow, q_flow), 8192*eps)
                m = start + 0.01_wp*r(:, 2)
                call integrate(rotor, scheme, top, 0.5_wp, 1, m, q, drift=drift, stat=stat)
                call t%equal(trim(names(i))//'-refuses-a-momentum-along-the-axis', stat, status_bad_momentum)
            end do
        end do
    end subroutine test_linear_rotors

    !> A compensated run keeps |q| through long turns, equal ones too: a sphere, and bodies that tumble.
    subroutine test_long_turns(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3, 3) = reshape([1.0_wp, 1.0_wp, 1.0_wp, 2.0_wp, 0.7_wp, 2.0_wp, &
                                                        0.3_wp, 1.0_wp, 0.31_wp], [3, 3])
        type(heavy_top) :: weightless
        real(wp) :: m(3), q(4)
        character :: digit
        integer :: k

        weightless%force = 0.0_wp
        do k = 1, 3
            m = [0.3_wp, 0.8_wp, -0.5_wp]
            q = [0.5_wp, -0.5_wp, 0.5_wp, 0.5_wp]
            call integrate(rigid_body(moments(:, k)), splitting_scheme('strang'), weightless, 5.0_wp, &
                           t%many(20000), m, q, compensated=.true.)
            write (digit, '(i0)') k
            call t%at_most('compensated-long-turns-keep-the-norm-of-body-'//digit, abs(norm_defect(q)), 2*eps)
        end do
    end subroutine test_long_turns

    !> Names of drifts that are known, and names that are refused.
    subroutine test_names(t)
        type(tally), intent(inout) :: t
        character(14), parameter :: wrong(7) = [character(14) :: 'dmv', 'frb_step:', 'frb_step:0', &
                                                'quat_step:x', 'quat_step:1001', 'free_flow:3', '']
        class(body_drift), allocatable :: drift
        integer :: i, stat
        logical :: right

        do i = 1, size(wrong)
            call drift_by_name(trim(wrong(i)), drift, stat)
            right = .false.
            select type (drift)
            type is (flow_drift)
                right = .true.
            end select
            call t%ok('a-name-that-is-none-is-refused-and-gives-the-free-flow', &
                      right .and. stat == status_bad_option)
        end do
        call drift_by_name('quat_step:17', drift, stat)
        right = .false.
        select type (drift)
        type is (quaternion_drift)
            right = drift%points == 17 .and. drift%frame == 1
        end select
        call t%ok('quat-step-with-17-points', right .and. stat == status_ok)
        call drift_by_name('frb_step', drift, stat)
        right = .false.
        select type (drift)
        type is (matrix_drift)
            right = drift%points == 0
        end select
        call t%ok('frb-step-is-exact-unless-told', right .and. stat == status_ok)
    end subroutine test_names

end module frb_test_drifts
