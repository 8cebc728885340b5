!> Part of the table `torque-cost`: how a row is written, and the cost of many interacting dipoles.
module frb_chart_dipoles
    use frb, only: wp, rigid_body, free_flow, group_scene, integrate, quat_conjugate, quat_rotate, &
        splitting_scheme, status_ok
    use frb_chart_output, only: chart_file, settings, quantile, say
    use frb_chart_timing, only: clock
    implicit none
    private

    public :: cost_of_dipoles, row

    !> Dipoles along axis 3 of bodies at the points of a square lattice, in each other's field: the N^2 part
    !> of a scene, without anything else.
    type, extends(group_scene) :: lattice
        integer :: side = 1
    contains
        procedure :: torques => lattice_torques
    end type lattice

contains

    !> Drift and kick of n = 1000 dipoles, and a step of srkn14.
    subroutine cost_of_dipoles(options, file)
        type(settings), intent(in) :: options
        type(chart_file), intent(inout) :: file
        integer, parameter :: n = 1000, drifts = 100
        real(wp), parameter :: h = 0.1_wp
        type(lattice) :: scene
        type(rigid_body) :: body
        real(wp), allocatable :: m(:, :), q(:, :), tau(:, :), ns(:, :)
        real(wp) :: start
        integer :: repetitions, r, i, stat

        repetitions = merge(3, 9, options%quick)
        scene%side = 32
        body = rigid_body([1.0_wp, 1.2_wp, 0.3_wp])
        allocate (m(3, n), q(4, n), tau(3, n), ns(repetitions, 3))
        do i = 1, n
            m(:, i) = [sin(1.0_wp*i), cos(2.0_wp*i), sin(3.0_wp*i)]
            q(:, i) = [cos(1.0_wp*i), sin(2.0_wp*i), cos(3.0_wp*i), sin(5.0_wp*i)]
            q(:, i) = q(:, i)/norm2(q(:, i))
        end do
        do r = 1, repetitions
            start = clock(.false.)
            do i = 1, drifts
                call free_flow(body, h/14, m, q)
            end do
            ns(r, 1) = (clock(.false.) - start)/drifts
            start = clock(.false.)
            call scene%torques(q, 0.0_wp, tau, stat)
            m = m + 1.0e-3_wp*tau
            ns(r, 2) = clock(.false.) - start
            start = clock(.false.)
            call integrate(body, splitting_scheme('srkn14'), scene, h, 1, m, q)
            ns(r, 3) = clock(.false.) - start
        end do
        ns = ns*1.0e3_wp
        call row(file, 'drift of 1000 dipoles [ms]', ns(:, 1))
        call row(file, 'kick of 1000 dipoles [ms]', ns(:, 2))
        call row(file, 'drift / kick of 1000 dipoles', ns(:, 1)/ns(:, 2))
        call row(file, 'a step of srkn14 / (15 drifts + 14 kicks) of 1000 dipoles', &
                 ns(:, 3)/(15*ns(:, 1) + 14*ns(:, 2)))
    end subroutine cost_of_dipoles

    !> A row of torque-cost: median and quartiles; on the screen the median.
    subroutine row(file, what, values)
        type(chart_file), intent(inout) :: file
        character(*), intent(in) :: what
        real(wp), intent(in) :: values(:)
        character(120) :: line

        write (line, '(2x,a70,es11.3)') what, quantile(values, 0.5_wp)
        call say(trim(line))
        write (file%line, '(a70,3es11.3)') what, quantile(values, 0.5_wp), quantile(values, 0.25_wp), &
            quantile(values, 0.75_wp)
        call file%put()
    end subroutine row

    !> tau_i = Q_i^T (p_i x E_i) with p = Q e3 and E_i the field of all others at centre i.
    pure subroutine lattice_torques(self, q, t, tau, stat)
        class(lattice), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(out) :: tau(:, :)
        integer, intent(out) :: stat
        real(wp) :: p(3, size(q, 2)), e(3), x, y, r2, pr, scale3
        integer :: i, j

        associate (unused => t)
        end associate
        do i = 1, size(q, 2)
            p(:, i) = quat_rotate(q(:, i), [0.0_wp, 0.0_wp, 1.0_wp])
        end do
        do i = 1, size(q, 2)
            e = 0.0_wp
            do j = 1, size(q, 2)
                if (j == i) cycle
                x = real(mod(i, self%side) - mod(j, self%side), wp)
                y = real(i/self%side - j/self%side, wp)
                r2 = x*x + y*y
                pr = 3*(x*p(1, j) + y*p(2, j))/r2
                scale3 = 0.05_wp/(r2*sqrt(r2))
                e(1) = e(1) + (pr*x - p(1, j))*scale3
                e(2) = e(2) + (pr*y - p(2, j))*scale3
                e(3) = e(3) - p(3, j)*scale3
            end do
            tau(:, i) = quat_rotate(quat_conjugate(q(:, i)), &
                                    [p(2, i)*e(3) - p(3, i)*e(2), p(3, i)*e(1) - p(1, i)*e(3), &
                                     p(1, i)*e(2) - p(2, i)*e(1)])
        end do
        stat = status_ok
    end subroutine lattice_torques

end module frb_chart_dipoles
